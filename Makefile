.PHONY: demos reports pages book test lint clean

# One thread per process: two processes share two cores, and the run times reported are those of one core.
export OMP_NUM_THREADS = 1
export NUMBA_NUM_THREADS = 1
JOBS = 2

# The lessons, the sections of the paper first. OPTIONS=--quick runs each in its quick form.
SECTIONS = $(sort $(wildcard demos/section_*.py))
LESSONS = $(SECTIONS) $(filter-out $(SECTIONS), $(sort $(wildcard demos/*.py)))
demos: .venv/ready
	printf '%s\n' $(LESSONS) | xargs -P $(JOBS) -I {} .venv/bin/python {} $(OPTIONS)

# The long studies, and the pages written from their summaries: all, or REPORTS="NAME ...".
reports: .venv/ready
	.venv/bin/python demos/reports $(REPORTS) $(OPTIONS)

# The pages again, and the table of the README, from the summaries of the last full runs.
pages: .venv/ready
	.venv/bin/python demos/reports --pages

# The course as a site in results/book: lessons are executed where they or the code below them changed.
# They run in their quick forms; SCENE_OPTIONS= runs them in full, which takes an hour or more.
SCENE_OPTIONS = --quick
book: .venv/book
	SCENE_OPTIONS="$(SCENE_OPTIONS)" .venv/bin/python demos/book/build.py

.venv/book: .venv/ready requirements-book.lock
	.venv/bin/python -m pip install --quiet --disable-pip-version-check --requirement requirements-book.lock
	touch $@

test: .venv/ready
	.venv/bin/python -m pytest -n 2 --dist worksteal

lint: .venv/ready
	.venv/bin/ruff check
	.venv/bin/mypy

clean:
	rm -rf .venv results .*_cache .hypothesis *.egg-info
	find . -name __pycache__ -prune -exec rm -rf {} +

.venv/ready: .ci/setup pyproject.toml requirements.lock
	.ci/setup

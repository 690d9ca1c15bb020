.PHONY: demos test lint clean

# One thread per process: the suite runs as two processes, and the run times reported are those of one core.
export OMP_NUM_THREADS = 1
export NUMBA_NUM_THREADS = 1

# The sections of the paper come first. OPTIONS=--quick runs each demo in its quick form.
SECTIONS = $(sort $(wildcard demos/section_*.py))
demos: .venv/ready
	set -e; for demo in $(SECTIONS) $(filter-out $(SECTIONS), $(sort $(wildcard demos/*.py))); do \
		.venv/bin/python "$$demo" $(OPTIONS); done

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

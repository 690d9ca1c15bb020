"""The order of the lessons."""

from pathlib import Path

DEMOS = Path(__file__).parents[1]
COURSE = {
    "By hand": ["node_and_spring", "hanging_rod"],
    "Pressed": ["section_3_1_1_normal_loading", "section_2_1_own_forms", "own_mesh"],
    "Friction": ["sticks_or_slips"],
    "Load paths": [
        "load_paths",
        "section_3_1_2_tangential_loading",
        "prescribed_motion",
        "sphere_on_plane",
    ],
    "Solvers": ["why_relaxation_crawls", "multigrid_by_hand"],
    "Impact and its energy": ["rod_impact", "section_3_2_bouncing_ring"],
    "Roughness": ["tread_block", "ring_on_rough_road"],
    "Finite rotation": ["rolling"],
}
BEYOND = "Further lessons"  # lessons that the course does not name yet
PARTS = {
    part: [DEMOS / f"{name}.py" for name in names if (DEMOS / f"{name}.py").exists()]
    for part, names in COURSE.items()
}
PARTS[BEYOND] = [
    script
    for script in sorted(DEMOS.glob("*.py"))
    if not any(script in scripts for scripts in PARTS.values())
]
LESSONS = [script for scripts in PARTS.values() for script in scripts]
PAGES = sorted((Path(__file__).parent / "pages").glob("*.py"))


def contents(source: Path) -> None:
    """Write the table of contents into the first page, in place of its last line."""
    page = source / "index.md"
    lists = [
        "\n".join(
            ["```{toctree}", f":caption: {part}", ":maxdepth: 1", "", *(s.stem for s in scripts), "```"]
        )
        for part, scripts in PARTS.items()
        if scripts
    ]
    text = page.read_text(encoding="utf-8")
    page.write_text(text.replace("% lessons\n", "\n\n".join(lists) + "\n"), encoding="utf-8")

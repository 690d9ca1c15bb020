"""The results that the README shows: words, scene, key."""

NORMAL = "section_3_1_1_normal_loading"
ROWS = [
    ("Peak pressure, 760 quadrilaterals", NORMAL, "p0[mu=0]"),
]

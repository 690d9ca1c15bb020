"""The results that the README shows: words, scene, key. A result that no kept summary has is left out."""

NORMAL = "section_3_1_1_normal_loading"
RING = "section_3_2_bouncing_ring"
TIMES = "error_against_run_time"
ROWS = [
    ("Hertz, 760 quadrilaterals: peak pressure", NORMAL, "p0[mu=0]"),
    ("Cattaneo and Mindlin: c/a", "tangential_refinement", "c_over_a[uncoupled, 57344 quads]"),
    ("sphere, 17,000 unknowns: peak pressure", "sphere_on_plane", "p0[dofs=17163]"),
    ("run time over that of a linear solve", TIMES, "cost_ratio_to_linear_solve"),
    ("times faster than PETSc's fastest, 115,000 unknowns", TIMES, "speedup_over_the_fastest_competitor"),
    ("sweeps to discretisation accuracy", TIMES, "work_units_to_discretisation_accuracy"),
    ("rod: pressure off by, mass redistribution", "rod_impact", "pressure_off_by[mass redistribution]"),
    ("ring: energy gained, mass redistribution", RING, "max_energy_gain_relative[mu=0,mass redistribution]"),
    ("ring: steps a period of the waves at impact", RING, "steps_per_wave_period"),
    ("finite strain: from sliding to rolling", "rolling", "sliding_to_rolling_time"),
    ("finite strain: Carter's creepage", "finite_strain", "creepage"),
    ("tread block: largest strain, for a linear model", "tread_block", "largest_strain[2-D]"),
    ("everyday scenes, drawn at random: wrong", "everyday_scenes", "wrong"),
    ("everyday scenes, drawn at random: not converged", "everyday_scenes", "not converged"),
    ("extreme cases judged wrong", "extreme_cases", "wrong"),
]

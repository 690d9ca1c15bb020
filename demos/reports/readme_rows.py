"""The results that the README shows: words, scene, key. A result that no kept summary has is left out."""

NORMAL = "section_3_1_1_normal_loading"
RING = "section_3_2_bouncing_ring"
TIMES = "error_against_run_time"
ROWS = [
    ("Hertz, 760 quadrilaterals: peak pressure", NORMAL, "p0[mu=0]"),
    ("Hertz, mesh-converged: peak pressure", "normal_loading_refinement", "p0[mesh-converged, uniform]"),
    ("friction 0.5, ten steps: peak pressure", NORMAL, "p0[mu=0.5]"),
    ("Cattaneo and Mindlin: c/a", "tangential_refinement", "c_over_a[uncoupled, 57344 quads]"),
    ("spread of c/a over a load path to P/100", "friction_refinement", "c_over_a_spread[P/100]"),
    ("cycles with friction over frictionless", "friction_refinement", "cycles_over_frictionless"),
    ("V(1,1) cycles, 1.8 million unknowns", TIMES, "cycles[dofs=1838082]"),
    ("run time over that of a linear solve", TIMES, "cost_ratio_to_linear_solve"),
    ("times faster than PETSc's fastest, 115,000 unknowns", TIMES, "speedup_over_the_fastest_competitor"),
    ("times faster than the loop, 760 quadrilaterals", TIMES, "speedup_over_loop_760"),
    ("sweeps to discretisation accuracy", TIMES, "work_units_to_discretisation_accuracy"),
    ("bandwidth of a sweep, 1.8 million unknowns", TIMES, "bandwidth_of_a_sweep[dofs=1838082]"),
    ("sphere, 17,000 unknowns: peak pressure", "sphere_on_plane", "p0[dofs=17163]"),
    ("Mindlin's c/a at Q = 0.75 mu F", "sphere_on_plane", "c_over_a[Q=0.75 mu F]"),
    ("rod: pressure off by, Newmark", "rod_impact", "pressure_off_by[Newmark]"),
    ("rod: pressure off by, mass redistribution", "rod_impact", "pressure_off_by[mass redistribution]"),
    ("ring: first touch, within its step", RING, "first_touch_within_step[mu=0]"),
    ("ring: energy gained, mass redistribution", RING, "max_energy_gain_relative[mu=0,mass redistribution]"),
    ("ring: steps a period of the waves at impact", RING, "steps_per_wave_period"),
    ("ring: 100 steps over as many linear ones", "ring_time_steps", "cost_ratio_to_linear_steps"),
    ("finite strain: second touch of the ring, mu = 0.1", "rolling_ring", "second_touch[finite, mu=0.1]"),
    ("finite strain: rotation at 0.9 s, mu = 0.5", "rolling_ring", "rotation[finite, mu=0.5]"),
    ("finite strain: energy gained, mu = 0.5", "rolling_ring", "max_energy_gain[finite, mu=0.5]"),
    ("finite strain: from sliding to rolling", "rolling_ring", "sliding_to_rolling_time"),
    ("tread block: nodes off the rough road", "tread_block", "off_the_road[2-D]"),
    ("tread block: largest strain, for a linear model", "tread_block", "largest_strain[2-D]"),
    ("extreme cases", "extreme_cases", "cases"),
    ("extreme cases judged wrong", "extreme_cases", "wrong"),
]

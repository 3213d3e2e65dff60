"""The measured flights of README's tables: files, maps, configurations, and what confirms what."""

# Name: import map, files under TRUELINE_DATA.
FLIGHTS = {
    "oval_1": ("nanobench", ["nanobench/B7_oval_fast_rep1.csv"]),
    "oval_2": ("nanobench", ["nanobench/B7_oval_fast_rep2.csv"]),
    "trefoil": ("nanobench", ["nanobench/B9_trefoil_fast_rep1.csv"]),
    "figure_eight": ("nanobench", ["nanobench/B3_figure8_fast_rep1.csv"]),
    "nanodrone_random": ("idsia_nanodrone", ["idsia_nanodrone/random1_20251017_run1.csv"]),
    "nanodrone_square": ("idsia_nanodrone", ["idsia_nanodrone/square_20251017_run2.csv"]),
    "bebop_5deg": ("li_bebop_drag", ["li_bebop_drag/5deg.csv", "li_bebop_drag/take_5deg.csv"]),
    "bebop_10deg": ("li_bebop_drag", ["li_bebop_drag/10deg.csv", "li_bebop_drag/take_10deg.csv"]),
    "bebop_gate": ("li_bebop_gate", ["li_bebop_gate/2019-01-28_20_50_32.csv"]),
    "racer_6004": ("li_trashcan_race", ["li_trashcan_race/6004.csv"]),
    "racer_6019": ("li_trashcan_race", ["li_trashcan_race/6019.csv"]),
    "neurobem_figure_eight": ("neurobem", ["neurobem/figure8_1_20210218170320seg2.csv"]),
    "neurobem_racetrack": ("neurobem", ["neurobem/racetrack_1_20210218171908seg2.csv"]),
    "throw_230": ("indi_throw", ["indi_throw/IROS2024_LOG00230_SI.csv"]),
    "throw_267": ("indi_throw", ["indi_throw/IROS2024_LOG00267_SI.csv"]),
}

# Flights to diagnose with the IMU drive, and the further ones that confirm.
IMU = {
    "oval_1": ["oval_2"],
    "oval_2": ["oval_1", "trefoil", "figure_eight"],
    "trefoil": ["oval_1", "oval_2", "figure_eight"],
    "figure_eight": [],
    "nanodrone_random": ["nanodrone_square"],
    "nanodrone_square": ["nanodrone_random"],
    "bebop_5deg": ["bebop_10deg"],
    "bebop_10deg": ["bebop_5deg"],
    "bebop_gate": [],
    "racer_6004": ["racer_6019"],
    "racer_6019": ["racer_6004"],
    "neurobem_figure_eight": ["neurobem_racetrack"],
    "neurobem_racetrack": ["neurobem_figure_eight"],
    "throw_230": ["throw_267"],
    "throw_267": ["throw_230"],
}
CALIBRATE_BY = {"racer_6004": "racer", "racer_6019": "racer"}  # default.yaml for the others, and to diagnose

# Flights to calibrate with the rotor drive, by configuration, and those to diagnose.
ROTORS = {"nanodrone_random": "rotors_nanodrone", "nanodrone_square": "rotors_nanodrone",
          "neurobem_racetrack": "rotors_neurobem", "neurobem_figure_eight": "rotors_neurobem",
          "oval_1": "rotors_nanobench", "oval_2": "rotors_nanobench",
          "throw_267": "rotors_indi_throw", "throw_230": "rotors_indi_throw"}
ROTOR_DIAGNOSES = {"nanodrone_random": ["nanodrone_square"],
                   "neurobem_racetrack": ["neurobem_figure_eight"],
                   "oval_1": ["oval_2"],
                   "throw_267": ["throw_230"]}
# Calibrated once more with the model that another flight's diagnosis gave.
ROTORS_WITH_MODEL = {"nanodrone_square": "nanodrone_random"}

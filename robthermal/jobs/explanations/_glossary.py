"""Words of reports and tables: what each says, and the page that derives it."""

from __future__ import annotations

WORDS_PAGE = "docs/explanations/words.md"  # with all of them
_WORDS = {  # page of docs/explanations: word to meaning
    "certificates": {
        "contraction": "Any two temperature histories under the same inputs approach each other while they stay in "
                       "the box. It does not say that they stay there.",
        "box": "A range for the temperature of every lump, and for every current, ambient and heat of a claim.",
        "invariance": "A box is never left: a machine that starts inside its ranges stays inside, whatever the "
                      "currents, heats and ambients do within theirs.",
        "certificate": "A file with every number that a claim depends on; a checker that shares no code with the "
                       "search derives the claim from it again.",
        "margin": "How far a claim is from failing, in the unit beside it.",
        "slack of the check": "What the checker found left in the inequality that proves the claim, in SI units. "
                              "Small is no weakness: the search stops close to the best number it can prove.",
        "proof": "How a claim was proven.",
        "evidence": "File in which the proof of a claim stands.",
        "rate": "Guaranteed rate of contraction [1/s]: differences shrink at least as exp(-rate t).",
        "proven": "Derived from the certificate in exact or ball arithmetic, and confirmed by the checker.",
        "verified": "The independent checker derived the claim again from the file.",
        "assumptions": "What a claim takes for granted about the machine; listed with numbers in the appendix.",
    },
    "system": {
        "lump": "A mass that is taken to have one temperature.",
        "link": "A heat path between two lumps or a lump and an ambient.",
        "ambient": "Surroundings with a temperature that the machine does not change.",
        "module": "A thermoelectric (Peltier) module: a current pumps heat from its cold to its hot face.",
        "sensor": "A reading of the temperature of a lump, or of the voltage of a module.",
        "machine": "Short hash of the network's numbers: claims with the same hash are about the same machine.",
    },
    "limits": {
        "usable current": "The current that every module may have, at the same time and independently: the smallest "
                          "of four bounds.",
        "contraction limit": "Largest current for which the stated box contracts; not a limit for use, since such a "
                             "current may leave the box.",
        "runaway limit": "0.98 I*: below it more current takes more heat from the cold side in steady state.",
        "I*": "Current at which a regulated module takes its largest heat; beyond it the hot side runs away [A].",
        "q*": "Largest heat a regulated module can take, at I* [W].",
        "rating": "The least of the declared current limits, of the bridges, and of what the supplies can drive.",
        "closed form I*": "I* of a module with constant properties on one thermal resistance, for comparison.",
        "basis": "How a bound is known: proven, computed or declared.",
        "cooling": "Positive currents: heat is pumped from the cold to the hot face.",
        "heating": "Negative currents: heat is pumped into the cold face.",
    },
    "report": {
        "SHA-256": "Fingerprint of a file: another file has another one.",
        "residual": "Measured minus modelled.",
        "rms": "Root mean square.",
        "beyond noise": "What is left of the rms of a residual after the noise of the sensor is taken off.",
        "tolerance": "Residual beyond the noise that the gate accepts [K].",
        "validation": "A record that no fit has seen.",
        "train": "A record that parameters were fitted to.",
        "nominal": "For the parameters exactly as they stand.",
        "parameter ranges": "For every combination of the parameters in their ranges; the verdict is about these.",
        "verdict": "PASS, PASS WITH REMARKS or FAIL: the worst reason decides.",
        "remark": "What a reader should know, and what alone fails nothing.",
        "estimated": "Computed from data, with an uncertainty.",
        "computed": "Calculated in floating point; not proven.",
        "declared": "Stated by a file; neither computed nor proven.",
        "cached": "Taken from an earlier run with the same inputs; its certificates were checked again.",
        "skipped": "The stage was not asked for.",
        "simulated data": "Records that a program made: they say nothing about a machine.",
    },
    "calibration": {
        "standard deviation": "Of an estimate, for the residuals as they are.",
        "prior": "What was known of a parameter before the records: a value with a standard deviation.",
        "at a bound": "The fit ended at an end of the range that the file allows: the optimum may lie beyond it.",
        "misfit": "Mean square of measured minus modelled in standard deviations; 1 is noise alone.",
        "undetermined": "The records change hardly at all when the parameter does: they say nothing about it.",
    },
    "diagnosis": {
        "gap": "What the model leaves of the readings.",
        "ΔBIC": "By how much an effect improves the Bayesian information criterion; above 10 it counts.",
        "p": "Probability that noise alone gives as large a value of the test.",
        "F of an extra heat": "F statistic of a free heat into that lump: where the misfit sits.",
        "scatter of healthy records": "How much a number differs between healthy days.",
        "visible if lower by": "Smallest decrease of a number that new records would have shown with a probability of "
                               "about 0.9; a smaller one may be there.",
        "visible if higher by": "The same for an increase.",
        "split": "Lump that is split in two.",
        "remainder before": "What the model leaves of the readings beyond the noise, before a lump is split in two.",
        "remainder after": "The same after a lump is split.",
        "at the other half": "What is moved to the other half of the lump: heat paths, sensors, heaters.",
        "F": "F statistic: explained variance per unknown over what is left.",
        "p of whiteness": "Probability that noise alone leaves residuals as correlated as these.",
        "share of the gap": "Part of what the model leaves that an effect explains.",
        "better in blocks": "In which share of the blocks of the records the effect helps by itself.",
        "spread over segments": "How much its size differs between the segments of the records.",
        "or as well": "Another value that explains the records as well: a lag that may change places with its lump.",
        "in augmented.toml": "Its size in the system that is written: fitted without what a finer network changes.",
        "limit": "Size of an effect that would have been seen with a probability of 0.9.",
        "noise alone": "What the noise of the sensors would leave.",
        "cannot be excluded": "Explains the records as well, within what noise decides.",
    },
    "controllers": {
        "phase margin": "Least phase that the loop may lose at its crossover until it is unstable [deg].",
        "gain margin": "Least factor that the gain of the loop may change by until it is unstable.",
        "modulus": "Least distance of the loop from -1; 1 over the largest sensitivity.",
        "delay": "Least further delay with which the loop is unstable [s].",
        "disk margin": "All loops at once may be multiplied by any complex numbers up to this distance.",
        "crossover": "Frequency at which the gain of the loop is one [rad/s].",
        "corner plants": "Plants with parameters at the ends of their ranges.",
        "Kp": "Proportional gain of a controller.",
        "Ki": "Integral gain of a controller.",
        "error, rms": "Root mean square of estimated minus true temperature in the simulated step.",
        "set-point": "Temperature that a controller holds.",
        "regulates": "Lump or sensor whose temperature a module holds.",
        "needed": "Steady current that holds the set-points.",
    },
    "frf_lpm": {
        "bins": "Frequencies at which a response is estimated.",
        "suspect bins": "Frequencies at which the data do not determine the response.",
    },
    "coupling": {
        "e12": "Synchronization error of two subsystems, y2 - y1.",
        "MA": "Moving average of e12 over the exposure window, three standard deviations; without and with coupling.",
        "MA before": "Moving average of e12 over the exposure window, three standard deviations; without and with "
                     "coupling.",
        "MA after": "Moving average of e12 over the exposure window, three standard deviations; without and with "
                    "coupling.",
        "MSD": "Moving standard deviation of e12 over the exposure window, three standard deviations; without and "
               "with coupling.",
        "MSD before": "Moving standard deviation of e12 over the exposure window, three standard deviations; without "
                      "and with coupling.",
        "MSD after": "Moving standard deviation of e12 over the exposure window, three standard deviations; without "
                     "and with coupling.",
        "asked at most": "Limit of a number that the coupling file asks for.",
        "solver's own": "What the solver says of its result on its grid; it proves nothing.",
        "states": "Order of a filter: how many numbers it remembers.",
        "robust number": "Largest spectral radius of the uncertain loop; below 1 it is stable for all plants under "
                         "the envelope.",
        "envelope": "Bound of the uncertainty over frequency.",
        "norm": "Largest amplification of a signal, or its energy.",
    },
}
GLOSSARY = {word: (meaning, page) for page, words in _WORDS.items() for word, meaning in words.items()}

"""What the claims rest on: the model they are about, and what each kind of certificate leaves open."""

from __future__ import annotations

from ...thermal import System

ARITHMETIC = "Python, numpy, FLINT and the processor that checked the certificates compute as specified."
_MACHINE = (
    "The machine is the lumped network in the certificate files: each lump has one temperature (Biot number below "
    "0.1).",
    "Module properties vary linearly with the mean of the two face temperatures; half of the Joule heat goes to each "
    "face.",
    "Currents are imposed (current drive).",
    "Heats not in the network stay within the stated ranges.",
)
_NOMINAL = ("Certificates are about the model with exactly the stated parameters; the calibration's uncertainty is "
            "not part of them.")
_RANGES = ("Claims \"for the parameter ranges\" are about all parameters in the ranges that their files state, in any "
           "combination; the other claims are about exactly the parameters as they stand. Ranges from a "
           "calibration hold the truth with the stated confidence if the model has the right structure.")
_OF_MODULES = _MACHINE[1:3]
_LINEAR = "The system is linear and does not change with time; its numbers are those in the certificate file."
KIND_ASSUMPTIONS: dict[str, tuple[str, ...]] = {
    "contraction": (
        "Temperatures and currents stay in the box of the claim. That is not part of a claim of contraction; where it "
        "is proven, \"The box is never left\" says so.",
        "The two histories that approach each other have the same currents, heats and ambients.",
    ),
    "invariance": ("The machine starts inside the box; currents, heats and ambients stay in their stated ranges.",),
    "runaway": (
        "One module with constant properties stands alone between a cold face, held at its set-point, and a sink "
        "behind one conductance, at rest.",
    ),
    "network": ("The network is linear, with the constant conductances of the certificate file.",),
    "network_peak": (
        "The network is linear, with the constant conductances of the certificate file.",
        "Nothing but the start heats it: there are no heat loads, and the surroundings stay at their temperature.",
    ),
    "observer": (
        "Between samples the plant moves as the sampled model says, with the heat outside of the passive network held; "
        "what it does otherwise disturbs the error, and is not part of the claim.",
        "Temperatures, their estimates and the currents stay in the box of the claim.",
    ),
    "gain": (
        "Both histories, with the disturbance and without it, stay in the box of the claim, and the disturbance within "
        "its size.",
    ),
    "regulated": (
        "The cold faces are held exactly at their set-points by currents in the stated ranges; the other temperatures "
        "stay in the box of the claim.",
    ),
    "stability": (_LINEAR,),
    "hinf": (_LINEAR,),
    "peak": (_LINEAR, "The system starts at rest."),
    "frequency": (_LINEAR,),
    "closed_loop": (_LINEAR, "The controller runs with the numbers of the certificate file, without limits or delays "
                    "beyond those of the plant."),
    "polytope": ("The plant is linear at every moment and lies in the convex hull of the vertices; the states that a "
                 "state feedback reads are measured.",
                 "Gain or controllers run with the numbers of the certificate file, without limits or delays; "
                 "controllers are averaged with the weights of the plant at that moment."),
    "ellipsoid": ("The plant is linear at every moment and lies in the convex hull of the vertices; disturbances stay "
                  "within what the sentence says.", "The controller runs with the numbers of the certificate file, "
                  "without delays, and without limits other than those of the sentence."),
    "scheduled": (
        "The feedback reads all lump temperatures at every moment, or at the samples that the sentence names, and the "
        "currents follow without delay.",
        "The machine starts inside the ellipsoid; ambients and heats stay in their stated ranges.",
    ),
    "loop": (
        "Controller and linearizing feedback law run as in the certificate file, read the true temperatures at the "
        "samples, and the current is held between them. Where the sentence says \"sampled model\", nothing is claimed "
        "of what the machine does between the samples.",
        "Temperatures stay in the box of the claim; where that is proven, \"The box is never left\" says so.",
    ),
}


def machine_assumptions(system: System, ranges: bool = False) -> tuple[str, ...]:
    """What every claim about a thermal system rests on; `ranges`: claims are made for parameter ranges too."""
    machine = (text for text in _MACHINE if system.modules or text not in _OF_MODULES)
    return (*machine, _RANGES if ranges else _NOMINAL, ARITHMETIC)


def kind_assumptions(kind: str) -> tuple[str, ...]:
    """What a kind of claim rests on, beside its model."""
    return KIND_ASSUMPTIONS.get(kind, ())

"""The one sentence of a certificate, built from its data: numbers in all their digits, names escaped."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

from . import (
    _contraction,
    _ellipsoid,
    _gain,
    _invariance,
    _network,
    _network_peak,
    _observer,
    _polytope,
    _runaway,
    _scheduled,
    _stability,
)
from ._exact import Interval, short
from ._hash import machine_hash, short_hash
from ._thermal import Network

_LISTED = 12  # ranges of parameters that a sentence lists; more are a table
_BOX = "(that they do is not part of this claim)"
_NORMS = {"sum": "the weighted sum of absolute differences", "max": "the weighted largest difference",
          "energy": "the capacity-weighted sum of squared differences",
          "lyapunov": "the quadratic form e'Pe of the differences"}
_CONSTANTS = {"seebeck": "S {} V/K", "resistance": "R {} Ohm", "conductance": "K {} W/K",
              "sink_conductance": "the hot side at g {} W/K", "sink_temperature": "to a sink of w {} K",
              "setpoint": "the cold face at x_c {} K"}
Parts = Mapping[str, Mapping[str, Any]]


def decimal(value: Fraction) -> str:
    """Return the exact decimal of a number, written as Python writes a double.

    Examples
    --------
    >>> decimal(Fraction("1.00000000000000000001")), decimal(Fraction("1e-7")), decimal(Fraction(-7))
    ('1.00000000000000000001', '1e-07', '-7')
    """
    if value == 0:
        return "0"
    q = value.denominator
    places = max((q & -q).bit_length() - 1, _fives(q))
    mantissa = str(abs(value.numerator) * 10**places // q)
    x, digits = len(mantissa) - 1 - places, mantissa.rstrip("0")
    if not -4 <= x < 16:
        text = digits[0] + ("." + digits[1:] if len(digits) > 1 else "") + f"e{'-' if x < 0 else '+'}{abs(x):02d}"
    elif x < 0:
        text = "0." + "0" * (-x - 1) + digits
    else:
        whole = digits.ljust(x + 1, "0")
        text = whole[:x + 1] + ("." + whole[x + 1:] if len(whole) > x + 1 else "")
    return "-" + text if value < 0 else text


def sentence(kind: str, problem: Any, parts: Parts) -> str:
    """Return the sentence that the data of a certificate give."""
    return _KINDS[kind](problem, parts)


def _fives(q: int) -> int:
    count = 0
    while q % 5 == 0:
        q, count = q // 5, count + 1
    return count


def _span(box: Interval) -> str:
    return f"[{decimal(box[0])}, {decimal(box[1])}]"


def _plural(count: int, word: str, many: str = "") -> str:
    return f"{count} {word if count == 1 else many or word + 's'}"


def _parameters(parameters: Mapping[str, Interval], parts: Parts) -> str:
    if not parameters:
        return "nominal parameters"
    title = f"for all values of {_plural(len(parameters), 'parameter')}"
    if len(parameters) > _LISTED:
        return f"{title} of table {short_hash(parts['region']['parameters'])}"
    return f"{title}: " + ", ".join(f"{short(name)} in {_span(box)}" for name, box in parameters.items())


def _subject(network: Network, parts: Parts, plant: str = "continuous plant") -> str:
    title = f" {short(network.name)}" if network.name else ""
    sizes = f"{_plural(len(network.lumps), 'lump')}, {_plural(len(network.modules), 'module')}"
    return (f"thermal network{title} ({sizes}, machine {machine_hash(parts['system'])}), {plant}, "
            f"{_parameters(network.parameters, parts)}")


def _temperatures(network: Network) -> str:
    boxes = network.temperature
    if all(box == boxes[0] for box in boxes):
        return f"in {_span(boxes[0])} K"
    return ", ".join(f"{short(name)} in {_span(box)} K" for name, box in zip(network.lumps, boxes, strict=True))


def _region(network: Network) -> str:
    words = _temperatures(network)
    currents = ", ".join(f"{short(module.name)} in {_span(box)} A"
                         for module, box in zip(network.modules, network.current, strict=True))
    return f"lump temperatures {words}" + (f" and module currents {currents}, each independent of the others"
                                           if currents else "")


def _heaters(network: Network) -> str:
    powers = ", ".join(f"{short(heater.name)} in {_span(heater.power)} W at {decimal(heater.reference)} K"
                       for heater in network.heaters)
    return f", heater powers {powers}, linear in the temperatures of their lumps" if powers else ""


def _rate(rate: Fraction) -> str:
    return f"decays at least as exp(-rate t), rate = {decimal(rate)} 1/s" if rate > 0 else "decays strictly"


def _contraction_claim(problem: _contraction.Problem, parts: Parts) -> str:
    network = problem.network
    return (f"The {_subject(network, parts)}, contracts for all {_region(network)}{_heaters(network)}: between any two "
            f"trajectories under the same inputs, as long as both stay in this box {_BOX}, {_NORMS[problem.method]} "
            f"(method {problem.method}) {_rate(problem.rate)}.")


def _invariance_claim(problem: _invariance.Problem, parts: Parts) -> str:
    network = problem.network
    inputs = [f"ambient {short(name)} in {_span(box)} K" for name, box in problem.ambient.items()]
    inputs += [f"heat load on {short(network.lumps[k])} in {_span(box)} W" for k, box in problem.heat.items()]
    words = f", for all {', '.join(inputs)}" if inputs else ""
    return (f"The {_subject(network, parts)}, never leaves the box of {_region(network)}{_heaters(network)}, once its "
            f"temperatures are in it{words}, with no other heat.")


def _gain_claim(problem: _gain.Problem, parts: Parts) -> str:
    network = problem.network
    ambients = "".join(f", ambient {short(name)} in {_span(box)} K" for name, box in problem.ambient.items())
    fades = (f"what is left of their start fades as exp(-rate t), rate = {decimal(problem.rate)} 1/s"
             if problem.rate > 0 else "if they start together")
    peaks = ", ".join(f"{decimal(max(channel.gains))} {'K/K from ambient' if channel.ambient else 'K/W from heat on'} "
                      f"{short(channel.name)}" for channel in problem.channels)
    return (f"In the {_subject(network, parts)}, for all {_region(network)}{ambients}: two trajectories under the same "
            f"currents that differ in one disturbance, as long as both stay in this box {_BOX}, never part in any lump "
            f"by more than that lump's peak gain times the largest difference of the disturbance, {fades}; the largest "
            f"gains are {peaks}, those of every lump are in table {short_hash(parts['evidence']['gains'])}.")


def _observer_claim(problem: _observer.Problem, parts: Parts) -> str:
    network = problem.network
    known = (", the same in plant and observer, A_d and Γ those of the nominal numbers and f all other heat"
             if network.parameters else "")
    sensors = ", ".join(f"{short(sensor.name)} ({decimal(sensor.gain)} times {short(network.lumps[sensor.lump])})"
                        for sensor in problem.sensors)
    speed = (f"shrinks at least by the factor {decimal(problem.contraction)}² per sample" if problem.contraction < 1
             else "shrinks strictly with every sample")
    return (f"The observer x^+ = A_d x^ + Γ f(x^, I) + L (y - C x^) of the "
            f"{_subject(network, parts, 'sampled model with held heat')}{known}, with sensors {sensors or 'none'}, "
            f"sampled every {decimal(problem.sample_time)} s, f held in between, converges for all {_region(network)}, "
            f"as long as temperatures and estimates both stay in this box {_BOX}: e'Pe of the error {speed}.")


def _network_claim(problem: _network.Problem, parts: Parts) -> str:
    spread = (f"for all conductances within {decimal(100 * problem.uncertainty)} % of the given ones, those between "
              "two lumps and the row sums each on their own" if problem.uncertainty > 0 else "nominal parameters")
    norm = "largest" if problem.method == "max" else "summed"
    return (f"The thermal network of {len(problem.capacity)} lumps and {len(problem.rows)} entries (machine "
            f"{machine_hash(parts['system'])}), continuous plant, {spread}, is stable: the weighted {norm} absolute "
            f"temperature difference (method {problem.method}) between any two of its trajectories under the same "
            f"inputs {_rate(problem.rate)}.")


def _network_peak_claim(problem: _network_peak.Problem, parts: Parts) -> str:
    return (f"In the thermal network of {len(problem.capacity)} lumps and {len(problem.rows)} entries (machine "
            f"{machine_hash(parts['system'])}), continuous plant, nominal parameters, without heat loads, temperatures "
            f"counted from that of the surroundings: from every start in which no lump is warmer than its entry in "
            f"table {short_hash(parts['region']['start'])}, lump {problem.lump} (counted from 0) never exceeds "
            f"{decimal(problem.bound)} K in the first {decimal(problem.horizon)} s.")


def _runaway_claim(problem: _runaway.Problem, parts: Parts) -> str:
    words = {}
    for key, value in problem.constants.items():
        low, high = problem.parameters.get(key, (value, value))
        words[key] = _CONSTANTS[key].format(f"= {decimal(low)}" if low == high else f"in {_span((low, high))}")
    S, R, K, g, w, x = words.values()
    title = f" {short(problem.name)}" if problem.name else ""
    return (f"The single module{title} (machine {machine_hash(parts['system'])}), steady states of the continuous "
            f"plant, {_parameters(problem.parameters, parts)}, with constant {S}, {R}, {K}, {g} {w}, {x}, carries more "
            f"load with more current up to a current in {_span(problem.current)} A, where the load is in "
            f"{_span(problem.load)} W and stops growing.")


def _stability_claim(problem: _stability.Problem, parts: Parts) -> str:
    sampled = problem.sample_time > 0
    time = f"sampled at {decimal(problem.sample_time)} s" if sampled else "continuous"
    modes = (f"absolute values below {decimal(1 - problem.rate)}" if sampled else
             f"real parts below {decimal(-problem.rate)}{' 1/s' if problem.rate else ''}")
    sizes = ", ".join((_plural(len(problem.A), "state"), _plural(problem.inputs, "input"),
                       _plural(problem.outputs, "output")))
    return (f"The linear system as given, {time} ({sizes}, machine {machine_hash(parts['system'])}), nominal "
            f"parameters, is asymptotically stable: all eigenvalues of A have {modes}.")


def _polytope_claim(problem: _polytope.Problem, parts: Parts) -> str:
    sampled, rates = problem.sample_time > 0, problem.rates
    if problem.measure == "region" or (problem.slack is not None and rates is None):
        plants = "every constant plant"
    elif rates is None:
        plants = "every plant, constant or varying with time in any way,"
    else:
        plants = ("every plant, constant or varying with time, its weights of the vertices no faster than "
                  f"{', '.join(map(decimal, rates))} 1/s,")
    closed, time = problem.closed, f"sampled at {decimal(problem.sample_time)} s" if sampled else "continuous"
    sizes = [_plural(closed.states, "state"), _plural(closed.inputs, "input"),
             f"the last {closed.controls} for control",
             *([_plural(closed.outputs, "output")] if closed.outputs else [])]
    who = f"The state feedback u = F x as given, {time},"
    if closed.measured:
        own = len(closed.at[0][0]) - closed.states
        who = (f"The controller u = K(w) y, {time}, the average of {_plural(len(closed.at), 'controller')} as given "
               "with the weights w of the plant,")
        sizes.append(f"the last {closed.measured} measured; controllers of {_plural(own, 'state')}; x: states of "
                     "plant and controller")
    return (f"{who} stabilizes {plants} in the convex hull of "
            f"{_plural(len(closed.at), 'vertex', 'vertices')} as given ({', '.join(sizes)}) (machine "
            f"{machine_hash(parts['system'])}), nominal parameters: {_polytope_measure(problem, sampled)}.")


def _polytope_measure(problem: _polytope.Problem, sampled: bool) -> str:
    stated, rate = problem.numbers, problem.numbers.get("rate", Fraction(0))
    if problem.measure == "stability":
        form = "x'Px" if problem.slack is None else "x'P(w)x, P(w) affine in the weights w,"
        if sampled:
            return f"{form} " + (f"shrinks at least by the factor {decimal(1 - rate)}² per sample" if rate > 0 else
                                 "shrinks strictly with every sample")
        return f"{form} " + (f"falls at least as exp(-2 rate t), rate = {decimal(rate)} 1/s" if rate > 0 else
                             "falls strictly")
    if problem.measure == "hinf":
        return ("the H-infinity norm, of a varying plant the L2 gain, from w to z stays below "
                f"{decimal(stated['bound'])}")
    if problem.measure == "h2":
        return ("the H2 norm, of a varying plant the root mean square of z in the long run under white noise w of unit "
                f"intensity, stays below {decimal(stated['bound'])}")
    words = [f"real parts below {decimal(-stated['decay'])} 1/s"] if "decay" in stated else []
    words += [f"damping ratios above {decimal(stated['damping'])}"] if "damping" in stated else []
    words += ([f"absolute values below {decimal(stated['radius'])}{'' if sampled else ' 1/s'}"] if "radius" in stated
              else [])
    return f"all eigenvalues of its loop have {' and '.join(words)}"


def _ellipsoid_claim(problem: _ellipsoid.Problem, parts: Parts) -> str:
    sampled, k, q = problem.sample_time > 0, problem.controls, problem.hidden
    time = f"sampled at {decimal(problem.sample_time)} s" if sampled else "continuous"
    sizes = ", ".join([_plural(problem.states, "state"), _plural(problem.inputs, "input"),
                       *([f"the last {k} for control"] if k else [])])
    words = f", with the controller as given ({_plural(q, 'state')})" if k else ""
    if problem.saturation is not None:
        words += f", its controls limited to {', '.join(map(decimal, problem.saturation))} on both sides"
    both = ", x the states of plant and controller" if q else ""
    return (f"Of every plant, constant or varying with time in any way, in the convex hull of "
            f"{_plural(len(problem.vertices), 'vertex', 'vertices')} as given, {time} ({sizes}) (machine "
            f"{machine_hash(parts['system'])}), nominal parameters{words}, the ellipsoid x'Px <= "
            f"{decimal(problem.level)}, P of table {short_hash(parts['evidence']['matrix'])}{both}, is never left"
            f"{_ellipsoid_disturbed(problem, sampled)}{_ellipsoid_kept(problem, parts, sampled)}.")


def _ellipsoid_disturbed(problem: _ellipsoid.Problem, sampled: bool) -> str:
    if problem.disturbance is not None:
        words = "Euclidean norm" if problem.joint else "absolute values"
        return (f" once x is in it, under disturbances of {words} at most "
                f"{', '.join(map(decimal, problem.disturbance))} at every moment")
    if problem.bound is not None and problem.performance is not None:
        return (f" from x = 0 under disturbances w of energy ({'sum' if sampled else 'integral'} of |w|²) at most "
                f"{decimal(problem.level)}, and the energy of the {_plural(len(problem.performance[0]), 'output')} z "
                f"is at most {decimal(problem.bound)}² times that of w")
    if sampled:
        speed = (f"shrinks at least by the factor {decimal(1 - problem.rate)}² per sample" if problem.rate > 0 else
                 "shrinks strictly with every sample")
    else:
        speed = (f"falls at least as exp(-2 rate t), rate = {decimal(problem.rate)} 1/s" if problem.rate > 0 else
                 "falls strictly")
    return f" once x is in it, without disturbance, and there x'Px {speed}"


def _ellipsoid_kept(problem: _ellipsoid.Problem, parts: Parts, sampled: bool) -> str:
    words, region = "", parts["region"]
    if problem.limits is not None:
        count = len(problem.limits[2])
        words += (f"; in it {_plural(count, 'limit')} of region table {short_hash(region['limits'])} "
                  f"{'is' if count == 1 else 'are'} kept")
    if problem.cost is not None:
        words += (f"; the {'sum' if sampled else 'integral'} of the cost of region table "
                  f"{short_hash(region['cost'])} from then on is at most x'Px")
    return words


def _scheduled_claim(problem: _scheduled.Problem, parts: Parts) -> str:
    network = problem.network
    outside = [f"ambient {short(name)} in {_span(box)} K" for name, box in problem.ambient.items()]
    outside += [f"heat load on {short(network.lumps[k])} in {_span(box)} W" for k, box in problem.heat.items()]
    words = f", for all {', '.join(outside)}, constant or not" if outside else ""
    currents = ", ".join(f"{short(module.name)} in {_span(box)} A"
                         for module, box in zip(network.modules, network.current, strict=True))
    held, rate, fall = "", problem.rate, "falls"
    if problem.sample_time is not None and problem.sampled_rate is not None:
        held = f", x sampled every {decimal(problem.sample_time)} s and the currents held in between"
        rate, fall = problem.sampled_rate, "falls from sample to sample"
    return (f"The {_subject(network, parts)}, with the state feedback I = I0 + F (x - x0) as given{held}{words}, with "
            f"no other heat: from every start with (x - x0)'P(x - x0) <= {decimal(problem.level)}, P of table "
            f"{short_hash(parts['evidence']['matrix'])}, this bound is kept for ever, and with it lump temperatures "
            f"{_temperatures(network)} and module currents {currents}; while ambients and heat loads are constant, "
            f"(x - x*)'P(x - x*) {fall} at least as exp(-2 rate t), rate = {decimal(rate)} 1/s, x* the only "
            f"equilibrium there, within {decimal(problem.offset)} K of x0 in every lump.")


_KINDS: dict[str, Callable[[Any, Parts], str]] = {
    "contraction": _contraction_claim, "invariance": _invariance_claim, "gain": _gain_claim,
    "observer": _observer_claim, "polytope": _polytope_claim, "ellipsoid": _ellipsoid_claim,
    "scheduled": _scheduled_claim, "network_peak": _network_peak_claim,
    "network": _network_claim, "runaway": _runaway_claim, "stability": _stability_claim}

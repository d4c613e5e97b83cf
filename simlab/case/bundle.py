"""The folder that a laboratory would deliver of a case, and the truth about it."""

import csv
import hashlib
import json
import secrets
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from simlab.article import (
    ECCENTRICITIES,
    INCLINATIONS_DEG,
    JOINT_NAMES,
    JOINT_NODES,
    SENSOR_NODE,
    TOLERANCES,
    clipped_variance,
)
from simlab.case.blows import (
    RECORD_SECONDS,
    SAMPLE_RATE,
    Averaged,
    average,
    direct_deviation,
    noise_deviation,
    record,
    record_frequency,
    sine_fit,
    strike,
)
from simlab.case.campaign import (
    ASKED_FOR,
    AVERAGES,
    CONFIGURATIONS,
    LINE_SPACING,
    MEASURED,
    PRESET_MM,
    ROWS,
    Campaign,
    Row,
    Setup,
)
from simlab.case.draw import Case, CaseKind, random_stream
from simlab.case.nuisances import Nuisances
from simlab.case.simulate import Simulated, simulate
from simlab.case.universal_file import AxisQuantity, Function, write_universal_file
from simlab.coupling import Complex
from simlab.elastomer import BLOW_AMPLITUDE
from simlab.stand import BuiltCase, Stand

SENSOR = Row(SENSOR_NODE, "y")
SET_UPS = 4
"""Number of set-ups over which a floor is averaged."""
NONCE_BYTES = 16
"""Random bytes in each seal, so that nobody finds a truth by trying all possible ones."""
DIRECT_COLUMNS = (
    "order",
    "time_s",
    "specimen",
    "configuration",
    "amplitude_pp_mm",
    "frequency_hz",
    "stiffness_n_per_m",
    "phase_deg",
    "thd_percent",
    "temperature_c",
    "sd_rel",
)


def write_case(case: Case, folder: Path) -> None:
    """Write setup.json, inverse_*.unv, direct.csv and, where blows are kept, blows/*.unv; make `folder` if need be.

    These files do not tell the case's effects.
    """
    folder.mkdir(parents=True, exist_ok=True)
    simulated = simulate(case)
    for number, setup in enumerate(simulated.campaign.setups):
        rng = np.random.default_rng([case.seed, 7, 4, number])
        count = len(MEASURED)
        blows = strike(
            rng,
            AVERAGES,
            _with_zero_line(simulated.accelerance[number, :count]),
            _with_zero_line(simulated.slope[number, :count]),
            np.concatenate([[0.0], simulated.frequency]),
            setup.peak_force,
            simulated.campaign,
            case.effects,
        )
        write_universal_file(folder / _inverse_file(number), _functions(average(blows)))
    if simulated.campaign.recorded:
        _write_blows(case, folder / "blows")
    _write_direct(case.seed, simulated, folder / "direct.csv")
    setup_text = json.dumps(stated_setup(simulated.campaign), indent=1)
    (folder / "setup.json").write_text(setup_text + "\n", encoding="utf-8")


def stated_setup(campaign: Campaign) -> dict[str, object]:
    """setup.json: the bench and the measurement as the laboratory states them, which is the drawing, not the truth."""
    beam, nuisances = campaign.drawing.beam, campaign.nuisances
    return {
        "format": "jointlab-bundle/1",
        "title": "supported beam",
        "beam": {
            "length": beam.length,
            "height": beam.height,
            "width": beam.width,
            "youngs_modulus": beam.youngs_modulus,
            "poisson_ratio": beam.poisson_ratio,
            "density": beam.density,
            "free_damping_ratios": beam.damping_ratios,
        },
        "node_positions": campaign.node_positions,
        "joints": [
            {
                "name": name,
                "node": JOINT_NODES[name],
                "inclinations_deg": INCLINATIONS_DEG[name],
                "eccentricity": ECCENTRICITIES[1],
                "added_mass": 0.0,
            }
            for name in JOINT_NAMES
        ],
        "accelerometer": {"node": SENSOR.node, "direction": SENSOR.direction, "mass": 0.0},
        "inverse": [_inverse_entry(number, setup) for number, setup in enumerate(campaign.setups)],
        "direct": {"file": "direct.csv", "preset_mm": PRESET_MM},
        "tolerances": TOLERANCES | (nuisances.deviations if nuisances is not None and nuisances.stated else {}),
        "predict": [
            {"response": [SENSOR.node, SENSOR.direction], "input": [row.node, row.direction]} for row in ASKED_FOR
        ],
    }


def truth(case: Case) -> dict[str, object]:
    """The truth of a case, ready for JSON.

    ``size`` is the fraction of each effect's plausible range; ``effects`` are those of the catalogue and ``novel``
    those outside it.  ``noise_percent`` is what sensor noise alone does to the rows asked for at 100 N,
    ``floor_percent`` how far an honest re-measurement of them, after a new set-up, would be off, and
    ``effect_percent`` how far the effects move both rigs' readings, all as 100 sqrt(sum |y - f|^2 / sum |y|^2).
    """
    simulated, without = simulate(case), simulate(case, without_effects=True)
    novel = case.kind is CaseKind.NOVEL
    names = [effect.name for effect in case.effects]
    article, campaign = case.article, case.campaign
    nominal = case.campaign.drawing.beam
    joints = list(article.joints.values())
    cylinders = [joint.cylinders[0] for joint in joints]
    return {
        "format": "simlab-truth/1",
        "seed": case.seed,
        "kind": str(case.kind),
        "effects": [] if novel else names,
        "novel": names if novel else [],
        "size": {effect.name: effect.size for effect in case.effects},
        "parameters": {effect.name: {"law": effect.law, **effect.values} for effect in case.effects},
        "floor_percent": floor_percent(case),
        "noise_percent": _noise_percent(simulated),
        "effect_percent": {
            "inverse": percent(without.accelerance, simulated.accelerance),
            "direct": percent(without.stiffness, simulated.stiffness),
        },
        "baseline": {
            "a": [cylinder.shear.real for cylinder in cylinders],
            "b": [cylinder.compression.real for cylinder in cylinders],
            "c": [cylinder.rotation.real for cylinder in cylinders],
            "ga": [cylinder.shear.imag / cylinder.shear.real for cylinder in cylinders],
            "gb": [cylinder.compression.imag / cylinder.compression.real for cylinder in cylinders],
            "E": article.beam.youngs_modulus / nominal.youngs_modulus,
            "rho": article.beam.density / nominal.density,
            "angle": [joint.lean_deg for joint in joints],
            "joint_x": [joint.position for joint in joints],
            "sensor_x": article.sensor_position,
            "direct_gain": campaign.tester_gain,
        },
        "joints": {name: _joint_truth(case, name) for name in JOINT_NAMES},
        "lab": {
            "acc_noise": campaign.acceleration_noise,
            "force_noise": campaign.force_noise,
            "width": campaign.pulse_width,
            "direct_noise": campaign.direct_noise,
            "order": campaign.order_kind,
            "nuisances": _nuisance_truth(campaign.nuisances),
            "amplitude_power": campaign.amplitude_power,
            "joint_amplitude": campaign.joint_amplitude,
            "amplitude_fall": campaign.amplitude_fall,
            "sets": [
                {
                    "peak": setup.peak_force,
                    "gain": setup.gain,
                    "dx": list(setup.offsets),
                    "temperature": setup.temperature,
                }
                for setup in campaign.setups
            ],
        },
    }


def sealed(document: Mapping[str, Any]) -> dict[str, Any]:
    """A truth with its nonce, ready for JSON; `commitment` is the hash of both."""
    return {"nonce": secrets.token_hex(NONCE_BYTES), "truth": json.loads(json.dumps(document))}


def commitment(seal: Mapping[str, Any]) -> str:
    """SHA-256 of a nonce and a truth, in hexadecimal digits."""
    return hashlib.sha256(json.dumps(seal, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def percent(model: Complex, data: Complex) -> float:
    """100 sqrt(sum |y - f|^2 / sum |y|^2)."""
    return 100.0 * float(np.sqrt(np.sum(np.abs(data - model) ** 2) / np.sum(np.abs(data) ** 2)))


def floor_percent(case: Case) -> float:
    """Rms gap, per cent, of a new measurement of the rows asked for, after a new set-up, at the first level."""
    rng = random_stream(case.seed, 5)
    known = case.without_error()
    simulated = simulate(known)
    reference = case.campaign.setups[0]
    rows = slice(len(MEASURED), len(ROWS))
    straight, slope = simulated.accelerance[0, rows], simulated.slope[0, rows]
    blows = strike(
        rng, AVERAGES, straight, slope, simulated.frequency, reference.peak_force, case.campaign, case.effects
    )
    size, moved = float(np.sum(np.abs(straight) ** 2)), float(np.sum(np.abs(slope) ** 2))
    gain = (1.0 + clipped_variance(TOLERANCES["sensor_gain"])) / reference.gain**2  # mean square, new over old
    by_gain = gain - 2.0 / reference.gain + 1.0
    by_place = gain * clipped_variance(TOLERANCES["impact_position"]) * moved / size
    own = 100.0 * np.sqrt(by_gain + by_place), percent(average(blows).accelerance, straight)
    return float(np.linalg.norm([*own, *_nuisance_percents(known, case.campaign.nuisances, straight, rng)]))


def _nuisance_percents(
    known: Case, nuisances: Nuisances | None, straight: Complex, rng: np.random.Generator
) -> tuple[float, ...]:
    """Rms gaps, per cent, by the error of accelerances, and by new set-ups of the joints with new blows."""
    if nuisances is None:
        return ()
    repeats = [nuisances.without_error().set_up_again(rng, len(ROWS)) for _ in range(SET_UPS)]
    again = [replace(known, campaign=replace(known.campaign, nuisances=each)) for each in repeats]
    off = [percent(_read_asked_for(each), straight) for each in again]
    return 100.0 * nuisances.deviations["model_error"], float(np.sqrt(np.mean(np.square(off))))


def _read_asked_for(case: Case) -> Complex:
    return Stand(BuiltCase.of(case), case.campaign.frequency).read(0, ASKED_FOR)[0]


def _noise_percent(simulated: Simulated) -> float:
    rows = slice(len(MEASURED), len(ROWS))
    true = simulated.accelerance[0, rows]
    deviation = noise_deviation(true, simulated.frequency, simulated.campaign, simulated.campaign.setups[0].peak_force)
    return 100.0 * float(np.sqrt(2 * np.sum(deviation**2) / np.sum(np.abs(true) ** 2)))


def _nuisance_truth(found: Nuisances | None) -> dict[str, object] | None:
    if found is None:
        return None
    scattered = {"stiffness": found.stiffness.tolist(), "gains": found.gains.tolist()}
    return {
        **found.deviations,
        **scattered,
        "blow_lean": found.lean_deviation,
        "leans": found.leans.tolist(),
        "heights": found.heights.tolist(),
        "stated": found.stated,
        "coherence": found.coherence,
        "common": found.common,
    }


def _joint_truth(case: Case, name: str) -> dict[str, object]:
    """k and h of a joint as the paper's model has it, without the effects."""
    matrix = case.article.joints[name].dynamic_stiffness(BLOW_AMPLITUDE, 100.0)[0]
    return {"k": matrix.real.tolist(), "h": matrix.imag.tolist()}


def _with_zero_line(values: Complex) -> Complex:
    """(rows, lines + 1): a beam on springs does not accelerate at 0 Hz."""
    return np.concatenate([np.zeros((len(values), 1), dtype=np.complex128), values], axis=1)


def _functions(measured: Averaged) -> list[Function]:
    accelerances = [
        Function(
            kind=4,
            name="accelerance",
            response=SENSOR,
            reference=row,
            axis=AxisQuantity.FREQUENCY,
            step=LINE_SPACING,
            values=values,
            ordinate=AxisQuantity.ACCELERATION,
            denominator=AxisQuantity.FORCE,
        )
        for row, values in zip(MEASURED, measured.accelerance, strict=True)
    ]
    coherences = [
        Function(6, "coherence", SENSOR, row, AxisQuantity.FREQUENCY, LINE_SPACING, values)
        for row, values in zip(MEASURED, measured.coherence, strict=True)
    ]
    return accelerances + coherences


def _write_blows(case: Case, folder: Path) -> None:
    """One blow of the reference set for every row whose blows are kept: force, then acceleration."""
    folder.mkdir(exist_ok=True)
    frequency = record_frequency()
    built = BuiltCase.of(case)
    campaign = built.campaign
    accelerance, slope = Stand(built, frequency).read(0)
    rows = [ROWS.index(row) for row in campaign.recorded]
    rng = np.random.default_rng([case.seed, 7, 8])
    peak_force = campaign.setups[0].peak_force
    blows = strike(rng, 1, accelerance[rows], slope[rows], frequency, peak_force, campaign, case.effects)
    for i, row in enumerate(campaign.recorded):
        records = [
            Function(
                1, name, response, row, AxisQuantity.TIME, 1 / SAMPLE_RATE, record(spectra[0, i]), ordinate=ordinate
            )
            for name, response, spectra, ordinate in (
                ("force", row, blows.force, AxisQuantity.FORCE),
                ("acceleration", SENSOR, blows.acceleration, AxisQuantity.ACCELERATION),
            )
        ]
        write_universal_file(folder / f"blow_{row.name}.unv", records)


def _write_direct(seed: int, simulated: Simulated, path: Path) -> None:
    rng = np.random.default_rng([seed, 7, 6])
    points, deviation = simulated.campaign.points, direct_deviation(simulated.campaign)
    fitted = sine_fit(rng, simulated.stiffness, deviation)
    distortion = simulated.distortion * (1 + 0.1 * rng.standard_normal(fitted.size))
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(DIRECT_COLUMNS)
        for i, stiffness in enumerate(fitted):
            writer.writerow(
                (
                    i + 1,
                    f"{points.time[i]:.1f}",
                    JOINT_NAMES[points.specimen[i]],
                    CONFIGURATIONS[points.configuration[i]],
                    f"{points.amplitude_pp_mm[i]:g}",
                    f"{points.frequency[i]:g}",
                    f"{abs(stiffness):.7g}",
                    f"{np.degrees(np.angle(stiffness)):.5f}",
                    f"{distortion[i]:.3f}",
                    f"{points.temperature[i]:.2f}",
                    f"{deviation[i]:.4g}",
                )
            )


def _inverse_file(number: int) -> str:
    return f"inverse_{number + 1}.unv"


def _inverse_entry(number: int, setup: Setup) -> dict[str, object]:
    return {
        "file": _inverse_file(number),
        "averages": AVERAGES,
        "peak_force": setup.peak_force,
        "temperature_c": round(setup.temperature, 1),
        "window": "none",
        "sample_rate": SAMPLE_RATE,
        "block_seconds": RECORD_SECONDS,
    }

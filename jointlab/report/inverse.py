"""The report's sections on the hammer experiment: Tables 2 to 4, Figs. 5 to 9, and levels of excitation."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.dof import Direction, Dof
from analysis.inverse.joint_fit import JointFit
from analysis.inverse.regression import UPPER
from analysis.modal.estimator import Estimator
from analysis.modal.spectra import Windows
from analysis.modes import Modes
from analysis.structure.agreement import ModeError
from analysis.structure.beam import Mesh
from analysis.structure.forward import eigensolution
from analysis.tables import FrequencyRow, TermRow, loss_factor_terms, stiffness_terms, supported_frequencies
from jointlab.identification.inverse import HIGHEST_PREDICTED, METHODS, Inverse, prior_effect_by_joint, stabilisation_of
from jointlab.identification.levels import Level, Levels
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.over_frequency import over_frequency
from jointlab.identification.save import joint_matrix
from jointlab.identification.statements import fit_statements
from jointlab.identification.undetermined_text import not_observable_text, weak_direction_text
from jointlab.identification.validity_text import check_text
from jointlab.report import figures
from jointlab.report.curves import figured_points
from jointlab.report.section import Item, Notice, Picture, Section, Table, ends, number
from jointlab.report.summary import (
    failed_checks,
    fault_notices,
    levels_left_out,
    levels_table,
    regularisation_notices,
    remedies,
)
from jointlab.report.tables import READING, matrix_tables, over_frequency_tables
from jointlab.report.typography import with_signs

Rows = tuple[tuple[str, ...], ...]

SHOWN_DIRECTIONS = 3
TOLERATED_MISFIT = 1.1  # chi-square per degree of freedom


def inverse_sections(inverse: Inverse, measurement: MeasuredArticle) -> list[Section]:
    """Modes, joints and forward prediction, and the faults of the measurement that they are from."""
    return [_modes(inverse, measurement), _joints(inverse), _prediction(inverse)]


def _modes(inverse: Inverse, measurement: MeasuredArticle) -> Section:
    modal = inverse.modal
    likelihood = {pair.measured: pair for pair in inverse.likelihood.errors}
    paper = {} if inverse.paper is None else {pair.measured: pair for pair in inverse.paper.errors}
    highest = HIGHEST_PREDICTED * float(np.max(modal.modes.frequency))
    theory = supported_frequencies(
        inverse.fitted_beam.beam, inverse.free_beam.mesh, inverse.joints_at_drawn_nodes, highest
    )
    rows = tuple(
        (
            str(mode + 1),
            ends(modal.frequency_ci95[mode], 6),
            *_predicted_frequencies(likelihood.get(mode), theory),
            f"{100 * paper[mode].frequency_error:+.2f}" if mode in paper else "–",
            ends(modal.loss_factor_ci95[mode]),
            *_predicted_shape(likelihood.get(mode)),
        )
        for mode in range(modal.modes.poles.size)
    )
    head = (
        "mode",
        "measured, 95 % (Hz)",
        "Timoshenko (Hz)",
        "Euler-Bernoulli (Hz)",
        "Timoshenko off by (%)",
        "paper's joints off by (%)",
        "loss factor, 95 %",
        "loss factor, predicted",
        "MAC",
    )
    return Section(
        "Modes of the supported beam",
        (
            "Predicted are the modes of the beam on the joints identified by maximum likelihood; one column shows how "
            "far those of the paper's own method are off, where it was possible. That method leaves k12 several per "
            "cent off even on exact modes, and modes that are near-repeated show it most.",
            *_averaging(inverse, measurement),
            *_misfit(inverse),
            *fault_notices(measurement),
            Table("Table 4: natural frequencies, measured and predicted", head, rows),
            Picture(
                "Stabilisation: poles of every model order; lines are the modes that were kept",
                figures.stabilisation(
                    stabilisation_of(inverse.measured), inverse.measured, inverse.modal.modes.frequency
                ),
            ),
            Picture("Fig. 6: mode shapes", _shapes(inverse)),
        ),
    )


def _predicted_frequencies(pair: ModeError | None, theory: Sequence[FrequencyRow]) -> tuple[str, str, str]:
    """Timoshenko, Euler-Bernoulli, and how far off the former is; dashes for a mode that nothing predicts."""
    if pair is None:
        return "–", "–", "–"
    other = theory[pair.predicted].euler_bernoulli if pair.predicted < len(theory) else None
    return (
        number(pair.predicted_frequency, 5),
        "–" if other is None else number(other, 5),
        f"{100 * pair.frequency_error:+.2f}",
    )


def _predicted_shape(pair: ModeError | None) -> tuple[str, str]:
    """Predicted loss factor and MAC; dashes for a mode that nothing predicts."""
    return ("–", "–") if pair is None else (number(pair.predicted_loss_factor), f"{pair.mac:.4f}")


def _averaging(inverse: Inverse, measurement: MeasuredArticle) -> list[str]:
    """How blows were averaged, where that is not by H1 of plain records."""
    first, found = measurement.sets[0], list[str]()
    if first.estimator in (Estimator.H2, Estimator.HV):
        found.append(f"Blows are averaged by {first.estimator}.")
    elif first.estimator == Estimator.LOCAL:
        found.append("Blows are averaged by H1, without what the cut end of each record adds (local).")
    if inverse.measured.decay > 0:
        lowest = float(Windows(decay=inverse.measured.decay).added_loss_factor(inverse.modal.modes.frequency[:1])[0])
        found.append(
            f"Records were seen through a window ({first.window}). Accelerances, measured and predicted, are shown "
            f"through it; the loss factor that it adds, {number(lowest)} in the lowest mode, is in neither modes nor "
            "joints."
        )
    return found


def _misfit(inverse: Inverse) -> list[str]:
    """A warning where the modes do not explain the accelerances to within their noise."""
    scale = inverse.modal.noise_scale
    if scale <= TOLERATED_MISFIT:
        return []
    return [
        f"These modes leave more than noise: chi-square is {number(scale)} per degree of freedom. Intervals are "
        "widened by its root, but something in the measurement is not a linear structure with these modes."
    ]


def _shapes(inverse: Inverse) -> str:
    """Fig. 6, the prediction at every node of the mesh."""
    mesh = inverse.free_beam.mesh
    every = Mesh(mesh.positions, tuple(range(mesh.positions.size)))
    beam = replace(inverse.fitted_beam, mesh=every)
    joints = [replace(joint, node=mesh.named[joint.node - 1] + 1) for joint in inverse.joints_at_drawn_nodes]
    nodes = [Dof(node, Direction.Y) for node in range(1, mesh.positions.size + 1)]
    highest = HIGHEST_PREDICTED * float(np.max(inverse.modal.modes.frequency))
    predicted = eigensolution(beam, joints, highest, nodes)
    pairs = sorted(inverse.likelihood.errors, key=lambda pair: pair.measured)
    measured, theirs = inverse.modal.modes, [pair.measured for pair in pairs]
    order = [pair.predicted for pair in pairs]
    return figures.mode_shapes(
        Modes(measured.poles[theirs], measured.shapes[theirs], measured.dofs),
        Modes(predicted.poles[order], predicted.shapes[order], predicted.dofs),
        {dof: float(mesh.positions[mesh.named[dof.node - 1]]) for dof in measured.dofs},
        {dof: float(mesh.positions[dof.node - 1]) for dof in nodes},
    )


def _joints(inverse: Inverse) -> Section:
    unit = inverse.free_beam.beam.stiffness_unit
    routes = [(METHODS[result.method], result.joints) for result in inverse.results]
    head = ("element", *(f"joint {name}, {method}" for method, joints in routes for name in joints))
    stiffness = [_term_rows(stiffness_terms(joints.values(), unit)) for _, joints in routes]
    loss_factor = [_term_rows(loss_factor_terms(joints.values())) for _, joints in routes]
    return Section(
        "Joints",
        (
            "Stiffness is divided by EI/L³ (translation), EI/L² (coupling) and EI/L (rotation). Terms in brackets are "
            "not observable: these data alone do not determine them. Maximum likelihood works on the accelerances "
            "themselves, with everything that the laboratory admits not to know of the bench estimated alongside; the "
            "paper's method works on the modes.",
            Table("Table 2: stiffness", head, _side_by_side(stiffness)),
            Table("Table 3: loss factor", head, _side_by_side(loss_factor)),
            *fit_statements(inverse.fit),
            *over_frequency_tables(over_frequency(inverse)),
            *regularisation_notices(inverse),
            *_prior_effect(inverse),
            *_validity_checks(inverse),
            *_cylinders(inverse.cylinders),
            *_weak(inverse),
            *remedies(inverse),
            READING,
            *_matrices(inverse),
            _papers_equations(inverse),
        ),
    )


def _papers_equations(inverse: Inverse) -> Picture | str:
    """Fig. 5, or why there is none."""
    if inverse.paper is None:
        return f"{inverse.paper_left_out}."
    sides = {name: (each.regression.observed, each.regression.fitted) for name, each in inverse.paper.joints.items()}
    return Picture("Fig. 5: equations of the paper's method, observed against curve-fitted", figures.regression(sides))


def _matrices(inverse: Inverse) -> list[Table]:
    """k, h and gamma of every joint in SI units, as the page has them."""
    return [
        table
        for result in inverse.results
        for joint in result.joints.values()
        for table in matrix_tables(joint_matrix(joint), result.method, not_observable_text(joint))
    ]


def _side_by_side(tables: Sequence[Rows]) -> Rows:
    """Tables with the same first column as one."""
    return tuple((*rows[0], *(cell for row in rows[1:] for cell in row[1:])) for rows in zip(*tables, strict=True))


def _prior_effect(inverse: Inverse) -> list[Table]:
    """Share of the prior in each term, and its bias; empty where terms were free."""
    if inverse.regularised is None:
        return []
    effects = prior_effect_by_joint(inverse.fit)
    rows = []
    for letter in "kh":
        for p, q in UPPER:
            cells = []
            for effect in effects.values():
                share, bias = (effect[f"{letter}_{what}"][p][q] for what in ("prior_share", "bias"))
                cells += [f"{100 * share:.1f}", number(bias)]
            rows.append((f"{letter}{p + 1}{q + 1}", *cells))
    columns = [f"joint {name}, {what}" for name in effects for what in ("from the prior (%)", "bias (SI)")]
    return [Table("Effect of the prior on each term", ("element", *columns), tuple(rows))]


def _validity_checks(inverse: Inverse) -> list[str] | list[Notice]:
    """The checks that the fit has to pass; those that fail are shown as failing."""
    checks = inverse.fit.all_checks
    if not inverse.fit.passed:
        return failed_checks(inverse)
    passed = f"All {len(checks)} checks passed: {'; '.join(with_signs(check_text(check)) for check in checks)}."
    return [f"{passed} That matrices are symmetric is an assumption; with one accelerometer nothing tests it."]


def _weak(inverse: Inverse) -> list[str]:
    """Combinations of terms that the accelerances hardly determine, a sentence each, the worst first."""
    weak = inverse.likelihood.weak_directions
    if weak is None:
        return ["It is not known which terms these accelerances determine."]
    if not weak:
        return ["These accelerances determine every term."]
    shown = [f"Hardly determined: {with_signs(weak_direction_text(each))}." for each in weak[:SHOWN_DIRECTIONS]]
    more = len(weak) - len(shown)
    return shown + ([f"So are {more} more combinations; the JSON document names them."] if more else [])


def _term_rows(terms: tuple[TermRow, ...]) -> Rows:
    """A row for each element of the upper triangle, a column for each joint."""
    elements = [term.element for term in terms if term.element[-2] <= term.element[-1]]
    wanted = dict.fromkeys(elements)

    def cell(term: TermRow) -> str:
        text = f"{number(term.value)} [{ends((term.low, term.high))}]"
        if term.value != term.value:
            return "–"
        return text if term.observable else f"({text})"

    return tuple((element, *(cell(term) for term in terms if term.element == element)) for element in wanted)


def _cylinders(fit: JointFit | None) -> list[str | Table]:
    """The joints from their cylinders, whose inclinations separate terms that matrices leave in a sum."""
    if fit is None:
        return ["The fit fails a check, so the cylinders that the joints are built of were not fitted from it."]
    rows = tuple(
        (
            name,
            *(ends(joint.k_ci95[at] / 1e6, 4) for at in ((0, 0), (0, 1), (1, 1))),
            ends(joint.loss_factor_ci95[1, 1]),
            "yes" if all(check.passed for check in joint.checks) else "no",
        )
        for name, joint in fit.joints.items()
    )
    head = (
        "joint",
        "k11 (MN/m), 95 %",
        "k12 (MN/m), 95 %",
        "k22 (MN/m), 95 %",
        "γ22, 95 %",
        "passes its checks",
    )
    return [
        "The same fit over the cylinders that the joints are built of: how they lean ties the terms of a matrix "
        "together, which distinguishes the two k11. It holds as far as the joints are built like that.",
        Table("Joints as their cylinders make them, Eqs. (8) to (11)", head, rows),
    ]


def _prediction(inverse: Inverse) -> Section:
    curves = {METHODS[result.method]: result.responses for result in inverse.results}
    pictures = tuple(
        Picture(
            f"{label}: accelerance at {inverse.measured.response} for a blow at {point}",
            figures.accelerance(label, inverse.measured, curves, point, inverse.fit.predicted),
        )
        for label, point in figured_points(inverse.measured)
    )
    agreement = inverse.agreement
    rows = tuple(
        (str(point), *(f"{agreement[method][row]:.4f}" for method in agreement))
        for row, point in enumerate(inverse.measured.inputs)
    )
    table = Table(
        "Frequency response assurance criterion of measured and predicted rows", ("blow at", *agreement), rows
    )
    return Section("Accelerances, measured and predicted", (*pictures, table))


def levels_section(every: Levels) -> Section:
    """Each set's joints at the amplitude that its blows or its sine caused, as a table and a picture."""
    levels = every.found
    content: list[Item] = [
        "Every set by itself. What sets have in common, such as gain, density and modulus, moves all alike: "
        "differences between sets are known better than each of them.",
        levels_table(levels),
        *levels_left_out(every),
    ]
    names = list(levels[0].fit.joints)
    curves = {name: _level_curve(levels, name) for name in names if all(name in level.amplitudes for level in levels)}
    if curves:
        content.append(Picture("Stiffness k22 against amplitude", figures.against_amplitude(curves)))
    content += [
        f"The amplitudes of set {level.number} are {next(iter(level.amplitudes.values())).source}."
        for level in levels
        if level.amplitudes
    ]
    failed = [level for level in levels if not level.fit.passed]
    content += [Notice(f"Set {level.number} fails a check; do not rely on it.", failed=True) for level in failed]
    return Section("Levels of excitation", tuple(content))


def _level_curve(levels: Sequence[Level], name: str) -> figures.LevelCurve:
    order = sorted(levels, key=lambda level: float(level.amplitudes[name].amplitude_pp[0]))
    return figures.LevelCurve(
        amplitude_pp=np.array([float(level.amplitudes[name].amplitude_pp[0]) for level in order]),
        stiffness=np.array([level.fit.joints[name].stiffness[1, 1] for level in order]),
        interval=np.array([level.fit.joints[name].k_ci95[1, 1] for level in order]),
    )

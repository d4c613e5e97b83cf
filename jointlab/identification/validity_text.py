"""What the checks of a fit found, in words."""

from analysis.inverse.validity_checks import (
    MISFIT,
    ChiSquare,
    Correlation,
    Couplings,
    LeastLoss,
    LeastStiffness,
    NextStep,
    StrongestCause,
    ValidityCheck,
    WorstDeviation,
)


def check_text(check: ValidityCheck) -> str:
    """What a check found, with figures and, where it failed, what that means."""
    match check.finding:
        case LeastLoss(joint, value, half):
            verdict = "no motion draws energy from it"
            if not check.passed:
                verdict = "a motion draws energy from it, which no elastomer can do"
            return f"least loss factor of joint {joint} {value:.2g} +-{half:.1g} (of all motions): {verdict}"
        case LeastStiffness(joint, value, half):
            verdict = "every motion meets resistance"
            if not check.passed:
                verdict = "a motion is pushed on, which no joint at rest can do"
            return f"least relative stiffness of joint {joint} {value:.2g} +-{half:.1g} (of all motions): {verdict}"
        case Couplings() as couplings:
            return _couplings_text(couplings, check.passed)
        case Correlation(deviations, limit):
            text = f"the residual of lines a few apart is alike by {deviations:.1f} standard deviations"
            meaning = f", above {limit:.1f}: something is not in the model, even where chi-square is small"
            return text if check.passed else text + meaning
        case StrongestCause() as strongest:
            return _cause_text(strongest, check.passed)
        case WorstDeviation(None):
            return "no deviation of the bench was estimated"
        case WorstDeviation(label, tolerances, limit):
            text = f"{label} is {tolerances:.1f} tolerances off"
            advice = "measure it again, state its tolerance, or look for what is not in the model"
            return text if check.passed else f"{text}, above {limit:.1f}: {advice}"
        case ChiSquare(total, row, of_row, frequency, of_line):
            text = f"chi-square is {total:.3g} per datum"
            worst = f"worst at {row} ({of_row:.3g}) and near {frequency:.1f} Hz ({of_line:.3g})"
            return text if check.passed else f"{text}, above {MISFIT:g}: the model does not explain the data; {worst}"
        case NextStep(decrease):
            return f"another step would lower chi-square by {decrease:.1g}"


def _couplings_text(found: Couplings, passed: bool) -> str:
    if passed:
        return (
            "joints couple motion along and across the beam as drawn" if found.judged else "no joint shows a coupling"
        )
    wrong = ", ".join(f"k12({joint}) is {value:.3g} N/m" for joint, value in found.against_drawing)
    return (
        f"{wrong}, against the drawing: either all rows along the beam have the wrong polarity, or the joints lean the "
        "other way than drawn; check the accelerometer, the hammer's direction and the inclinations"
    )


def _cause_text(found: StrongestCause, passed: bool) -> str:
    cause = found.cause
    if cause is None:
        return "no further cause could be distinguished from the fitted parameters"
    size = f"{cause.value:.2g}" if cause.unit == "1" else f"{cause.value:.2g} {cause.unit}"
    text = f"a {cause.name} of {size} would lower chi-square by {cause.gain:.3g}"
    if not found.shows:
        return f"{text}, as noise can"
    text += f" (noise: {found.limit:.0f} at most)"
    if passed:
        return f"{text}; intervals allow for {found.together:.1f} standard deviations of a term"
    moves = f"{found.moves:.1f} standard deviations"
    return f"{text} and move a term by {moves}: it, or something like it, is not in the model"

"""`jointlab gap diagnose DATA --model`: a simulator and an effect of one's own, on curves in a CSV file."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from analysis.gap.structures.curve import Curve
from tests.api.conftest import Command
from tests.jointlab.structures.curves import write_curves

EXAMPLES = Path(__file__).resolve().parents[3] / "docs" / "examples"
MODEL = f"{EXAMPLES / 'own_simulator.py'}:pendulum"


@pytest.fixture
def loaded(tmp_path: Path) -> Path:
    """Natural frequencies of masses on a spring that is stiffer under load, in four series."""
    random, curves = np.random.default_rng(4), []
    mass = np.linspace(0.5, 3.0, 8)
    for load in (0.0, 10.0, 20.0, 30.0):
        exact = np.sqrt(1030.0 * (1 + 0.004 * load) / (mass + 0.11)) / (2 * np.pi)
        conditions = {"mass": mass, "temperature": np.full(8, 20.0 + load / 10), "load": np.full(8, load)}
        values = exact * (1 + 1e-3 * random.standard_normal(8))
        curves.append(Curve("frequency", f"{load:g} N", values, 1e-3 * exact, conditions))
    write_curves(tmp_path / "loaded.csv", curves)
    return tmp_path / "loaded.csv"


def test_an_effect_of_ones_own_is_named_and_the_curves_are_drawn(jointlab: Command, loaded: Path) -> None:
    effect = f"{EXAMPLES / 'own_effect.py'}:LoadStiffening"
    asked = ("--effect", effect, "--hold-out", "20 N", "--json", "gap.json", "--picture", "gap.svg")
    answer = jointlab("gap", "diagnose", loaded, "--model", MODEL, *asked)
    assert answer.returncode == 0, answer.stderr
    assert "EXPLAINED: stiffness grows with the static load (load_stiffening, the only one)" in answer.stdout
    assert "Gap on parts that nothing has seen" in answer.stdout
    document = json.loads((loaded.parent / "gap.json").read_text(encoding="utf-8"))
    (found,) = document["verdict"]["effects"]
    low, high = found["parameters"]["per_newton"]["ci90"]
    assert low < 0.004 < high
    never = document["gap_percent"]["never_shown"]
    assert never["after"] < 0.2 * never["before"]
    assert document["verdict"]["probability"] <= 0.95  # no trial of this simulator is known
    assert "<svg" in (loaded.parent / "gap.svg").read_text(encoding="utf-8")


@pytest.mark.usefixtures("terminal")
def test_a_terminal_shows_a_first_answer_under_the_bar_until_the_last_one(jointlab: Command, loaded: Path) -> None:
    effect = f"{EXAMPLES / 'own_effect.py'}:LoadStiffening"
    answer = jointlab("gap", "diagnose", loaded, "--model", MODEL, "--effect", effect, "--json", "gap.json")
    assert answer.returncode == 0, answer.stderr
    assert "fitting the simulation without effects" in answer.stderr
    told = "first answer, not final: stiffness grows with the static load (load_stiffening), explain"
    assert told in answer.stderr
    assert "not final" not in last_drawn(answer.stderr)
    assert "not final" not in answer.stdout
    assert "not final" not in (loaded.parent / "gap.json").read_text(encoding="utf-8")


def last_drawn(shown: str) -> str:
    """What a terminal shows at the end, of a bar that is drawn again and again over itself."""
    bars = shown.split("100/100")
    assert len(bars) > 1, "the bar came to its end"
    return bars[-1]


def test_without_it_the_closest_effect_of_the_simulator_is_not_taken_for_the_cause(
    jointlab: Command, loaded: Path
) -> None:
    answer = jointlab("gap", "diagnose", loaded, "--model", MODEL, "--without", "warm_spring")
    assert answer.returncode == 0, answer.stderr
    assert "UNKNOWN" in answer.stdout


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--model", "nothing"), "names no simulator"),
        (("--model", MODEL, "--hold-out", "5 N"), "no part is called '5 N'; there are 0 N"),
        (("--model", MODEL, "--effect", "math:pi"), "is no effect"),
        (("--hold-out", "5 N"), "belong to --model"),
        (("--fitted-to", "0 N"), "belong to --model"),
        (("--model", MODEL, "--fitted-to", "5 N"), "no part is called '5 N'"),
        (("--model", MODEL, "--without", "nosuch"), "no effect is called 'nosuch'; there are warm_spring"),
        (("--model", MODEL, "--json", "nowhere/gap.json"), "nowhere/gap.json cannot be written"),
        (("--model", MODEL, "--model-out", "nowhere/model.json"), "nowhere/model.json cannot be written"),
        (("--model", MODEL, "--model-out", "model.h5"), "with --model the name is to end in .json"),
        (("--model", MODEL, "--picture", "gap.xyz"), "the name is to end in .svg or .png"),
        (("--model", MODEL, "--picture", "nowhere/gap.svg"), "nowhere/gap.svg cannot be written"),
    ],
)
def test_what_cannot_be_done_is_told_in_a_line(
    jointlab: Command, loaded: Path, options: tuple[str, ...], said: str
) -> None:
    answer = jointlab("gap", "diagnose", loaded, *options)
    assert answer.returncode != 0
    assert said in " ".join(answer.stderr.split())
    assert "Traceback" not in answer.stderr
    assert "EXPLAINED" not in answer.stdout  # what is wrong is told before the work


BAD = """
class Fails:
    name, parameters, local = "shed", (), ()
    def effects(self, curves): raise OSError("no licence")
    def predict(self, values, acting, curve): return curve.values

class Nothing(Fails):
    def effects(self, curves): return None

fails, nothing = Fails(), Nothing()
"""


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("fails", "the effects of simulator shed fail: OSError: no licence"),
        ("nothing", "the effects of simulator shed fail: TypeError"),
        ("Fails", "bad.py:Fails is a class, not a simulator"),
    ],
)
def test_a_simulator_that_fails_is_told_in_a_line_by_diagnosis_and_trial(
    jointlab: Command, loaded: Path, name: str, said: str
) -> None:
    (loaded.parent / "bad.py").write_text(BAD, encoding="utf-8")
    for asked in (("diagnose", loaded), ("trial", "--on", loaded, "--cases", "2")):
        answer = jointlab("gap", *asked, "--model", f"bad.py:{name}")
        assert answer.returncode == 3
        assert said in " ".join(answer.stderr.split())
        assert "Traceback" not in answer.stderr


SLIPS = """
from analysis.gap.effect import Mechanism
from analysis.gap.parameter import Parameter
from analysis.gap.structures.callable_simulator import CallableSimulator
from analysis.gap.structures.effect import StructureEffect
from jointlab.plug_ins import object_named

own = object_named({model!r}, "simulator", [])

class NoTitle(StructureEffect):
    id, mechanism, own_parameters = "no_title", Mechanism.BEAM, (Parameter("a", "1", 0.0, 0.1),)

class ListId(NoTitle):
    id, title = ["a"], "a list"

slips = CallableSimulator(own.function, own.parameters, (*own.candidates, NoTitle(), ListId()), name="slips")
"""


def test_effects_without_a_title_or_with_a_list_for_an_id_are_named_and_the_diagnosis_goes_on(
    jointlab: Command, loaded: Path
) -> None:
    (loaded.parent / "slips.py").write_text(SLIPS.format(model=MODEL), encoding="utf-8")
    answer = jointlab("gap", "diagnose", loaded, "--model", "slips.py:slips")
    assert answer.returncode == 0, answer.stderr
    said = " ".join(answer.stdout.split())
    assert "NOT TRIED: no_title (the only one): the effect NoTitle has no title" in said
    assert "NOT TRIED: ['a'] (the only one): the effect ListId: id is ['a']" in said


def test_a_record_limits_the_probability_of_its_own_simulator_and_effects_alone(
    jointlab: Command, loaded: Path
) -> None:
    asked = ("--model", MODEL, "--on", loaded, "--cases", "3", "--publish", "scores.json")
    assert jointlab("gap", "trial", *asked).returncode == 0
    recorded = ("gap", "diagnose", loaded, "--model", MODEL, "--record", "scores.json")
    answer = jointlab(*recorded)
    assert answer.returncode == 0, answer.stderr
    refused = jointlab(*recorded, "--effect", f"{EXAMPLES / 'own_effect.py'}:LoadStiffening")
    assert refused.returncode == 3
    assert "this diagnosis tries load_stiffening, warm_spring; run `jointlab gap trial" in " ".join(
        refused.stderr.split()
    )


def test_a_trial_tries_an_effect_of_ones_own_and_publishes_its_scores(jointlab: Command, loaded: Path) -> None:
    effect = f"{EXAMPLES / 'own_effect.py'}:LoadStiffening"
    asked = ("--model", MODEL, "--on", loaded, "--cases", "3", "--publish", "scores.json")
    assert jointlab("gap", "trial", *asked, "--effect", effect).returncode == 0
    published = json.loads((loaded.parent / "scores.json").read_text(encoding="utf-8"))
    assert (published["simulator"], published["cases"]) == ("mass on a spring", 3)
    refused = jointlab("gap", "trial", *asked, "--effect", "math:pi")
    assert (refused.returncode, "is no effect" in refused.stderr) == (3, True)


def test_scores_that_cannot_be_published_are_told_before_the_trial(jointlab: Command, loaded: Path) -> None:
    answer = jointlab("gap", "trial", "--model", MODEL, "--on", loaded, "--cases", "3", "--publish", "nowhere/x.json")
    assert (answer.returncode, "nowhere/x.json cannot be written" in " ".join(answer.stderr.split())) == (3, True)
    assert answer.stdout == ""


def test_predictions_that_cannot_be_written_are_told_in_a_line(jointlab: Command, loaded: Path) -> None:
    answer = jointlab("gap", "predict", "model.json", loaded, "nowhere/out.csv", "--model", MODEL)
    assert (answer.returncode, "nowhere/out.csv cannot be written" in " ".join(answer.stderr.split())) == (3, True)


@pytest.mark.parametrize(
    "command",
    [
        ("predict", "model.json", "loaded.csv", "loaded.csv", "--model", MODEL),
        ("predict", "model.json", "loaded.csv", "./model.json", "--model", MODEL),
        ("diagnose", "loaded.csv", "--model", MODEL, "--json", "loaded.csv"),
        ("diagnose", "loaded.csv", "--model", MODEL, "--record", "model.json", "--model-out", "model.json"),
        ("trial", "--model", MODEL, "--on", "loaded.csv", "--publish", "loaded.csv"),
        ("diagnose", "bundle.zip", "--model-out", "bundle.zip"),
        ("diagnose", "bundle.zip", "--with-effect", "model.json", "--model-out", "model.json"),
    ],
)
def test_what_a_command_reads_is_not_written_over(jointlab: Command, loaded: Path, command: tuple[str, ...]) -> None:
    for name in ("model.json", "bundle.zip"):
        (loaded.parent / name).write_text("{}", encoding="utf-8")
    before = {each.name: each.read_bytes() for each in loaded.parent.iterdir()}
    answer = jointlab("gap", *command)
    assert answer.returncode != 0
    assert "name another file to write" in " ".join(answer.stderr.split())
    assert {each.name: each.read_bytes() for each in loaded.parent.iterdir()} == before


def test_two_results_do_not_go_to_one_file(jointlab: Command, loaded: Path) -> None:
    answer = jointlab("gap", "diagnose", loaded, "--model", MODEL, "--json", "x.json", "--model-out", "./x.json")
    assert answer.returncode != 0
    assert "x.json is to be written twice" in " ".join(answer.stderr.split())


def test_the_corrected_simulation_predicts_what_nothing_has_seen_as_the_diagnosis_says(
    jointlab: Command, loaded: Path
) -> None:
    effect = f"{EXAMPLES / 'own_effect.py'}:LoadStiffening"
    asked = ("--hold-out", "20 N", "--model-out", "model.json", "--json", "gap.json")
    answer = jointlab("gap", "diagnose", loaded, "--model", MODEL, "--effect", effect, *asked)
    assert answer.returncode == 0, answer.stderr
    answer = jointlab("gap", "predict", "model.json", loaded, "out.csv", "--model", MODEL, "--effect", effect)
    assert answer.returncode == 0, answer.stderr
    never = json.loads((loaded.parent / "gap.json").read_text(encoding="utf-8"))["gap_percent"]["never_shown"]
    assert f"20 N: gap {never['before']:.3g} % before, {never['after']:.3g} % after" in answer.stdout
    lines = np.genfromtxt(loaded.parent / "out.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    exact = np.sqrt(1030.0 * (1 + 0.004 * lines["load"]) / (lines["mass"] + 0.11)) / (2 * np.pi)
    assert np.all(np.abs(lines["after_real"] - exact) < 5 * lines["after_deviation"])
    assert np.all(lines["after_deviation"] < 2e-3 * exact)


def test_what_was_never_measured_is_predicted_without_values(jointlab: Command, loaded: Path) -> None:
    answer = jointlab("gap", "diagnose", loaded, "--model", MODEL, "--model-out", "model.json")
    assert answer.returncode == 0, answer.stderr
    (loaded.parent / "asked.csv").write_text(
        "part,observable,mass,temperature,load\nnew,frequency,1,20,0\nnew,frequency,2,20,0\n", encoding="utf-8"
    )
    answer = jointlab("gap", "predict", "model.json", "asked.csv", "out.csv", "--model", MODEL)
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout.strip() == "out.csv written"
    lines = np.genfromtxt(loaded.parent / "out.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    assert lines["before_real"][0] > lines["before_real"][1] > 0


def test_a_part_that_cannot_be_predicted_is_named_and_the_others_are(jointlab: Command, loaded: Path) -> None:
    jointlab("gap", "diagnose", loaded, "--model", MODEL, "--model-out", "model.json")
    header = "part,observable,mass,temperature,load\n"
    (loaded.parent / "asked.csv").write_text(f"{header}new,frequency,1,20,0\nother,frequency,,20,0\n", encoding="utf-8")
    answer = jointlab("gap", "predict", "model.json", "asked.csv", "out.csv", "--model", MODEL)
    assert answer.returncode == 0, answer.stderr
    assert "NOT PREDICTED: frequency of part 'other': simulator mass on a spring" in " ".join(answer.stdout.split())
    assert len((loaded.parent / "out.csv").read_text(encoding="utf-8").splitlines()) == 2


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda text: text.replace('"simulator":"', '"simulator":"another '), "belongs to the simulator 'another"),
        (lambda text: text.replace("LoadStiffening", "Gone"), "is not known; name it with --effect"),
        (lambda text: text.replace('"format":"jointlab-structure-model/1"', '"format":"x"'), "no corrected simulation"),
        (lambda text: text.replace('"value":', '"value":1'), "has changed since the file was written"),
    ],
)
def test_a_file_that_does_not_fit_the_simulator_is_refused_in_a_line(
    jointlab: Command, loaded: Path, change: Callable[[str], str], said: str
) -> None:
    effect = f"{EXAMPLES / 'own_effect.py'}:LoadStiffening"
    jointlab("gap", "diagnose", loaded, "--model", MODEL, "--effect", effect, "--model-out", "model.json")
    file = loaded.parent / "model.json"
    text = file.read_text(encoding="utf-8").replace('": ', '":')
    assert change(text) != text
    file.write_text(change(text), encoding="utf-8")
    answer = jointlab("gap", "predict", "model.json", loaded, "out.csv", "--model", MODEL, "--effect", effect)
    assert answer.returncode != 0
    assert said in " ".join(answer.stderr.split())
    assert "Traceback" not in answer.stderr
    assert not (loaded.parent / "out.csv").exists()

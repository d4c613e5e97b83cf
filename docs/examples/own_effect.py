"""An effect of one's own: a spring that is stiffer under tension than under compression by a static load.

Try it with: jointlab gap diagnose DATA --model own_simulator.py:pendulum --effect own_effect.py:LoadStiffening
"""

from analysis.gap.effect import Mechanism
from analysis.gap.parameter import Parameter
from analysis.gap.structures.effect import StructureEffect


class LoadStiffening(StructureEffect):
    """Stiffness grows in proportion to the static load, a condition of every curve."""

    id = "load_stiffening"
    title = "stiffness grows with the static load"
    mechanism = Mechanism.JOINT_STATE
    form_is_known = False  # a real spring does so roughly
    needs = frozenset({"load"})  # N; the effect is not tried on curves that do not have it
    own_parameters = (Parameter("per_newton", "1/N", centre=0.0, spread=0.01),)

    def properties(self, given, properties, conditions):
        """Change one property of the simulator for each value of a curve."""
        factor = 1 + given["per_newton"] * conditions["load"]
        return {**properties, "spring": properties["spring"] * factor}

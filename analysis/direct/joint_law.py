"""Laws of a cylinder and of a joint: its stiffness terms at any amplitude and frequency, Eqs. (8) and (13)-(15)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from analysis.direct.corrections import joint_covariance
from analysis.direct.cylinder_terms import CylinderTerms, JointTerms, joint_terms
from analysis.direct.elastomer_law import ElastomerLaw
from analysis.direct.law_fit import fit_elastomer_law


@dataclass(frozen=True)
class CylinderLaw:
    """Laws of the shear stiffness a and the compressive stiffness b of one cylinder."""

    shear: ElastomerLaw
    compression: ElastomerLaw

    def at(self, amplitude_pp: float, frequency: float) -> CylinderTerms:
        """Terms a and b at `amplitude_pp` m and `frequency` Hz; but for what points share, errors are independent.

        Raises:
            AnalysisError: amplitude or frequency is not positive.
        """
        shear, compression = (law.at(amplitude_pp, frequency) for law in (self.shear, self.compression))
        return CylinderTerms(shear, compression, joint_covariance((shear, compression)), misfit=1.0)


@dataclass(frozen=True)
class JointLaw:
    """The law of a joint of two opposed cylinders of one kind.

    Attributes:
        cylinder: laws of its a and b.
        inclination: theta of Eq. (10) of either cylinder, rad; signs as in `cylinder_terms.joint_terms`.
    """

    cylinder: CylinderLaw
    inclination: float

    def at(self, amplitude_pp: float, frequency: float) -> JointTerms:
        """Terms k11, k22, k12 at `amplitude_pp` m and `frequency` Hz.

        Raises:
            AnalysisError: amplitude or frequency is not positive.
        """
        return joint_terms(self.cylinder.at(amplitude_pp, frequency), self.inclination)

    def beyond(self, amplitude_pp: float, frequency: float) -> tuple[str, ...]:
        """In which way a question is outside of what was measured, one phrase each; empty inside."""
        return self.cylinder.compression.beyond(amplitude_pp, frequency)

    @property
    def frequencies(self) -> tuple[float, float]:
        """Lowest and highest that were measured, Hz."""
        return self.cylinder.compression.frequencies


def fit_cylinder_law(terms: Sequence[CylinderTerms]) -> CylinderLaw:
    """Laws of a and b of a cylinder from its terms at all frequencies and amplitudes.

    Raises:
        AnalysisError: what `fit_elastomer_law` raises.
    """
    return CylinderLaw(
        shear=fit_elastomer_law([each.shear for each in terms]),
        compression=fit_elastomer_law([each.compression for each in terms]),
    )

"""The check of an article before it is measured, and before its description is amended."""

from analysis.structure.setup import check_setup
from store.exchange.bundle_setup import Article


def check_identifiable(article: Article) -> None:
    """Let an article pass on which joints can be identified; AnalysisError says why they cannot."""
    joints = {joint.name: joint.node for joint in article.joints}
    check_setup(article.beam.length, article.node_positions, article.beam.free_damping_ratios, joints)

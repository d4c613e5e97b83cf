"""Links in the schema: requests that can follow on what a request has made or found."""

from typing import Any

Links = dict[int | str, dict[str, Any]]
RESULTS = (
    "channels-of-run", "blows-and-points-points", "blows-and-points-blows", "blows-and-points-sine-records",
    "analyses-list", "FRFs-list", "modes-get", "joint-matrices-of-run", "dynamic-stiffness-of-run",
    "comparisons-of-run",
)  # fmt: skip


def links(status: int, parameter: str, *operations: str, field: str = "id") -> Links:
    """For the `responses` of a route: `operations` take `field` of its answer, with `status`, as their `parameter`."""
    found = {
        name.replace("-", "_"): {"operationId": name, "parameters": {parameter: f"$response.body#/{field}"}}
        for name in operations
    }
    return {status: {"description": "Successful Response", "links": found}}


def first_of(parameter: str, *operations: str) -> Links:
    """For the `responses` of a list: `operations` take the number of its first item as their `parameter`."""
    return links(200, parameter, *operations, field="items/0/id")


def run_links() -> Links:
    """Requests that can follow on the creation of a run."""
    return links(
        201, "run_id", "runs-get", "runs-history", "runs-start", "runs-pause", "runs-resume", "runs-stop",
        "runs-answer", *RESULTS,
    )  # fmt: skip

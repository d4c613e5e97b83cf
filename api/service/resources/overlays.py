"""Route of overlays: results of several runs over each other."""

from typing import Annotated

from fastapi import APIRouter, Query

from api.service.access import ReaderContext
from api.service.etags import TaggedRoute
from api.service.problems import problems
from jointlab.documents.fields import LARGEST
from jointlab.documents.overlay import OverlayDocument
from jointlab.documents.stiffness import LARGEST_AMPLITUDE
from jointlab.overlay import FEWEST, MOST_RUNS, read_results
from jointlab.overlay_document import overlay_document
from rig.errors import RequestError
from store.validation import TextLike

router = APIRouter(prefix="/overlay", tags=["overlays"], route_class=TaggedRoute)
Place = Annotated[str, TextLike(r"^[1-9][0-9]{0,5}[xyr]$", "write node and direction, such as 3y")]


@router.get("", name="get", responses=problems(404, 500))
def overlay(
    context: ReaderContext,
    run: Annotated[
        list[Annotated[int, Query(ge=1, le=LARGEST)]],
        Query(min_length=FEWEST, max_length=MOST_RUNS, description="numbers of the runs, each once"),
    ],
    amplitude_pp_mm: Annotated[
        float | None,
        Query(
            gt=0,
            le=LARGEST_AMPLITUDE,
            description="of the sine points, peak to peak, commanded, mm; the first of `amplitudes_pp_mm` where none "
            "is given",
        ),
    ] = None,
    point: Annotated[
        Place | None, Query(description="where the hammer struck, such as 3y; that of the first of `rows`")
    ] = None,
    response: Annotated[
        Place | None, Query(description="where the accelerometer sat, such as 3y; that of the first of `rows`")
    ] = None,
) -> OverlayDocument:
    """Results of two to twelve runs over each other: sweeps, one accelerance, and joints by the hammer.

    404 says what the runs have in common, where they do not have what is asked for.
    """
    if len(set(run)) < len(run):
        raise RequestError("a run is there twice; name each run once")
    return overlay_document(read_results(context.catalogue, run), amplitude_pp_mm, point, response)

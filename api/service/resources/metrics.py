"""Route of metrics, for Prometheus."""

from fastapi import APIRouter, Request, Response
from fastapi.responses import PlainTextResponse

from api.service.access import ReaderContext
from api.service.metrics import CONTENT_TYPE, Metrics
from api.service.problems import problems

router = APIRouter(prefix="/metrics", tags=["metrics"])


@router.get("", name="read", response_class=PlainTextResponse, responses=problems())
def read_metrics(request: Request, context: ReaderContext) -> Response:
    """What a laboratory watches, in the text format of Prometheus; it is there without the database, too."""
    metrics: Metrics = request.app.state.metrics
    return Response(metrics.text(context, request.app.state.probe.state), media_type=CONTENT_TYPE)

"""Documents with an entity tag are what FastAPI would write, written by the thread that read them."""

import math
import threading
from typing import Any

import pytest
from fastapi import APIRouter, FastAPI
from fastapi.routing import APIRoute
from pydantic import BaseModel, Field, field_serializer

from api.service.etags import TaggedRoute, tag_of
from api.service.pages import Page
from tests.api.service.conftest import served


class Reading(BaseModel):
    value: float | None
    made_in: int = Field(alias="madeIn", default=0)


class Thread(BaseModel):
    read_by: int

    @field_serializer("read_by")
    def with_the_writer(self, read_by: int) -> list[int]:
        return [read_by, threading.get_ident()]


def answers(route: type[APIRoute], path: str) -> Any:
    router = APIRouter(route_class=route)

    @router.get("/page")
    def page() -> Page[Reading]:
        return Page(items=[Reading(value=math.inf, madeIn=3), Reading(value=None)], next="on")

    @router.get("/none")
    def none() -> Reading | None:
        return None

    @router.get("/thread")
    def thread() -> Thread:
        return Thread(read_by=threading.get_ident())

    @router.get("/waits-for-nothing")
    async def waits_for_nothing() -> Reading:
        return Reading(value=1.5)

    app = FastAPI()
    app.include_router(router)
    with served(app) as client:
        return client.get(path)


@pytest.mark.parametrize("path", ["/page", "/none", "/waits-for-nothing"])
def test_a_tagged_document_is_the_one_that_the_framework_writes(path: str) -> None:
    plain, tagged = answers(APIRoute, path), answers(TaggedRoute, path)
    assert tagged.content == plain.content
    assert (tagged.status_code, tagged.headers["content-type"]) == (200, plain.headers["content-type"])
    assert tagged.headers["etag"] == tag_of(plain.content)


def test_the_thread_that_reads_a_document_writes_it() -> None:
    read_by, written_by = answers(TaggedRoute, "/thread").json()["read_by"]
    assert written_by == read_by != threading.get_ident()

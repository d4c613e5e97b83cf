"""Keys over REST, and the audit log."""

import httpx
from sqlalchemy import text

from store.catalogue import Catalogue
from store.states import Scope
from tests.api.service.conftest import Acting, MakeKey


def test_the_first_key_locks_the_service_for_callers_without_one(client: httpx.Client, acting: Acting) -> None:
    assert client.get("/api/runs").status_code == 200
    made = client.post("/api/keys", json={"name": "me", "scopes": ["admin"]}, headers=acting())
    assert made.status_code == 201
    locked = client.get("/api/runs")
    assert (locked.status_code, locked.headers["www-authenticate"]) == (401, "Bearer")
    assert client.get("/api/health").status_code == 200
    bearer = {"Authorization": f"Bearer {made.json()['secret']}"}
    assert client.get("/api/keys", headers=bearer).json()["items"][0]["name"] == "me"
    assert client.get("/api/runs", headers=bearer).status_code == 403


def test_a_request_under_another_host_name_needs_a_key(client: httpx.Client) -> None:
    assert client.get("/api/runs", headers={"Host": "evil.example"}).status_code == 401


def test_a_secret_is_shown_once_and_not_stored(client: httpx.Client, catalogue: Catalogue, acting: Acting) -> None:
    headers = acting()
    made = client.post("/api/keys", json={"name": "me", "scopes": ["admin"]}, headers=headers)
    secret = made.json()["secret"]
    with catalogue.reading() as session:
        for table in ("api_keys", "requests", "audit_entries"):
            assert secret not in repr(session.execute(text(f"SELECT * FROM {table}")).all()), table


def test_a_repeat_of_the_answer_has_no_secret(client: httpx.Client, acting: Acting, make_key: MakeKey) -> None:
    headers = acting(make_key(Scope.ADMIN))
    body = {"name": "page", "scopes": ["read:data"]}
    first = client.post("/api/keys", json=body, headers=headers).json()
    again = client.post("/api/keys", json=body, headers=headers).json()
    assert again == first | {"secret": None}


def test_a_revoked_key_opens_nothing(client: httpx.Client, acting: Acting, make_key: MakeKey) -> None:
    admin, reader = make_key(Scope.ADMIN), make_key(Scope.READ)
    bearer = {"Authorization": f"Bearer {reader}"}
    assert client.get("/api/runs", headers=bearer).status_code == 200
    assert client.post("/api/keys/2/revoke", headers=acting(admin)).status_code == 200
    answer = client.get("/api/runs", headers=bearer)
    assert answer.status_code == 401
    assert answer.json()["detail"].startswith("key 2 (test) was revoked at ")


def test_the_last_key_that_manages_keys_is_kept(client: httpx.Client, acting: Acting, make_key: MakeKey) -> None:
    admin, _ = make_key(Scope.ADMIN), make_key(Scope.ADMIN, revoked=True)
    refused = client.post("/api/keys/1/revoke", headers=acting(admin))
    assert (refused.status_code, "the last one that manages keys" in refused.json()["detail"]) == (409, True)
    other = make_key(Scope.ADMIN)
    assert client.post("/api/keys/1/revoke", headers=acting(other)).status_code == 200


def test_a_key_that_ends_in_the_past_is_refused(client: httpx.Client, acting: Acting, make_key: MakeKey) -> None:
    body = {"name": "late", "scopes": ["read:data"], "expires_at": "2020-01-01T00:00:00Z"}
    answer = client.post("/api/keys", json=body, headers=acting(make_key(Scope.ADMIN)))
    assert (answer.status_code, "would open nothing" in answer.json()["detail"]) == (422, True)


def test_the_audit_log_has_caller_action_and_target(client: httpx.Client, acting: Acting, make_key: MakeKey) -> None:
    headers = acting(make_key(Scope.ADMIN))
    client.post("/api/keys", json={"name": "page", "scopes": ["read:data"]}, headers=headers)
    client.post("/api/keys/99/revoke", headers=acting(headers["Authorization"].removeprefix("Bearer ")))
    entries = client.get("/api/audit", headers=headers).json()["items"]
    assert [(each["who"], each["action"], each["target"], each["outcome"]) for each in entries] == [
        ("key 1 (test)", "revoke key", "key 99", "there is no key 99"),
        ("key 1 (test)", "create key", "keys", "done"),
    ]
    filtered = client.get("/api/audit", params={"action": "create key"}, headers=headers).json()["items"]
    assert [each["details"]["name"] for each in filtered] == ["page"]

"""Headers of every answer."""

import httpx
import pytest

from api.service.headers import EVERYWHERE, policy_of


@pytest.mark.parametrize("path", ["/api/health", "/docs", "/nowhere", "/openapi.json"])
def test_every_answer_says_what_a_browser_may_do_with_it(client: httpx.Client, path: str) -> None:
    headers = client.get(path).headers
    assert {name: headers[name] for name in EVERYWHERE} == EVERYWHERE
    assert "frame-ancestors 'self'" in headers["content-security-policy"]
    assert "server" not in headers


@pytest.mark.parametrize("host", ["", "evil.example; script-src *", "a b", "'none'", "x\r\ny", "[::1"])
def test_a_host_that_is_no_name_is_not_in_the_policy(host: str) -> None:
    assert policy_of("/page/", host) == policy_of("/page/", "")


@pytest.mark.parametrize("host", ["127.0.0.1:8000", "lab.example", "[::1]:8000"])
def test_the_page_may_reach_other_ports_of_its_own_computer(host: str) -> None:
    name = "[::1]" if host.startswith("[") else host.split(":")[0]
    assert f"connect-src 'self' http://{name}:* https://{name}:*" in policy_of("/page/", host)

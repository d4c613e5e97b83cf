"""From blows and sine points to results, files and the gap, by the buttons of the page."""

import csv
import io
import json
from pathlib import Path

import httpx
import pytest
from playwright.sync_api import Page, expect

from jointlab.jobs.work import JobHeartbeat
from store.catalogue import Catalogue
from store.service.audit import list_audit_entries
from store.service.jobs import add_job, fail_job, list_jobs, take_job
from tests.api.page.technician import Service, Tab

A4_BETWEEN_MARGINS = 718  # px of CSS, with a centimetre on either side


@pytest.fixture
def page(reader: Tab) -> Page:
    return reader.go("/page/results?run=1")


def part(page: Page, name: str) -> None:
    """Open a part of the results."""
    page.get_by_role("navigation", name="parts of the results").get_by_role("link", name=name, exact=True).click()


def test_identify_brings_results_and_says_where_they_are_from(page: Page) -> None:
    page.get_by_role("button", name="Identify").click()
    expect(page.get_by_role("region", name="Jobs").get_by_role("row").nth(1)).to_contain_text("done")
    part(page, "Modes")
    expect(page.get_by_role("region", name="Modes").get_by_role("row")).to_have_count(7)
    expect(page.get_by_role("img", name="mode 1,")).to_be_visible()
    page.get_by_text("Where is this from?").click()
    expect(page.get_by_text("least-squares complex frequency domain")).to_be_visible()


def test_a_bundle_is_made_without_the_points_that_it_cannot_hold(campaign: Service, page: Page) -> None:
    page.get_by_role("button", name="Bundle without unfit points").click()
    newest = page.get_by_role("region", name="Jobs").get_by_role("row").nth(1)
    expect(newest).to_contain_text("done")
    expect(newest.get_by_role("link", name="Open run-1-")).to_be_visible()
    with Catalogue.open(campaign.database) as catalogue, catalogue.reading() as session:
        asked = list_jobs(session)[0].parameters
    assert asked == {"run": 1, "form": "bundle", "leave_out_unfit_points": True}


def test_a_refused_bundle_names_the_button_that_leaves_its_points_out(campaign: Service, page: Page) -> None:
    with Catalogue.open(campaign.database) as catalogue, catalogue.writing() as session:
        job = add_job(session, "export", {"run": 1, "form": "bundle"}, "a test")
        taken = take_job(session, ["export"])
        assert taken is not None
        fail_job(session, job.id, taken[1], "sine point 2 cannot be exported: it is cold", {"unfit_points": []})
    newest = page.get_by_role("region", name="Jobs").get_by_role("row").nth(1)
    expect(newest).to_contain_text("sine point 2 cannot be exported: it is cold.")
    expect(newest).to_contain_text("“Bundle without unfit points” leaves such points out")
    expect(page.get_by_role("button", name="Bundle without unfit points")).to_be_visible()


def test_a_report_is_signed_by_the_name_beside_its_buttons(campaign: Service, page: Page) -> None:
    name = page.get_by_label("Signed by")
    name.fill("x" * 501)
    page.get_by_role("button", name="Report", exact=True).click()
    said = page.locator(".q-field", has=name).get_by_role("alert")
    expect(said).to_contain_text("write a name in one line")
    name.fill(" Ann Miller ")
    page.get_by_role("button", name="Report", exact=True).click()
    expect(said).to_have_count(0)
    newest = page.get_by_role("region", name="Jobs").get_by_role("row").nth(1)
    expect(newest).to_contain_text("export report signed by Ann Miller")
    expect(newest).to_contain_text("done")
    with Catalogue.open(campaign.database) as catalogue, catalogue.reading() as session:
        asked = list_jobs(session)[0].parameters
        (signed,) = list_audit_entries(session, action="sign report")
    assert asked == {"run": 1, "form": "report", "signed_by": "Ann Miller"}
    assert signed.details["signed_by"] == "Ann Miller"


def test_a_diagnosis_shows_what_it_has_found_so_far_until_it_is_over(campaign: Service, page: Page) -> None:
    answer = "first answer, not final: mass at the joints (joint_mass), explains 40 % of the misfit"
    with Catalogue.open(campaign.database) as catalogue:
        with catalogue.writing() as session:  # one transaction: no worker of the service sees the job waiting
            job = add_job(session, "diagnose", {"run": 1}, "ann")
            taken = take_job(session, ["diagnose"])
        assert taken is not None
        newest = page.get_by_role("region", name="Jobs").get_by_role("row").nth(1)
        with JobHeartbeat(catalogue, job.id, taken[1]) as heartbeat, heartbeat("diagnosis", 100) as advance:
            advance(42, answer)
            expect(newest).to_contain_text(f"running: diagnosis, 42 of 100; {answer}")
            page.get_by_role("button", name=f"Cancel job {job.id}").click()
            expect(newest).to_contain_text("cancelled: diagnosis, 42 of 100")
            expect(newest).not_to_contain_text("first answer")


def test_the_headline_has_both_methods_side_by_side_above_all_details(page: Page, diagnosis: int) -> None:
    joint = page.get_by_role("region", name="Joint II; tester carried to")
    row = joint.get_by_role("row").filter(has_text="k22 (MN/m)")
    expect(row.get_by_role("cell")).to_have_count(3)
    hammer, tester = row.get_by_role("cell").all_inner_texts()[1:]
    assert "…" in hammer
    assert tester.startswith(("✓", "✗"))
    expect(page.get_by_text("compared quantities")).to_be_visible()
    expect(page.get_by_text("the gap falls from 12.3 % to 3.1 %")).to_be_visible()
    page.get_by_role("link", name="See the diagnosis").click()
    expect(page.locator("#verdict")).to_have_text("explained")
    assert f"diagnosis={diagnosis}" in page.url


def test_each_term_that_is_not_observable_is_greyed_with_its_own_reason(page: Page, demo: Path) -> None:
    found = json.loads((demo / "summary.json").read_text(encoding="utf-8"))
    reasons = found["inverse"]["I"]["not_observable"]
    part(page, "Joints")
    matrix = page.get_by_role("region", name="k of joint I, node 2, maximum likelihood")
    expect(matrix.locator("td.unknown").first).to_contain_text("only k11(I) + k11(II) is seen")
    assert sorted(matrix.locator("td.unknown small").all_inner_texts()) == sorted(reasons.values())
    assert len(set(reasons.values())) >= 2
    expect(matrix.get_by_role("row").nth(2).get_by_role("cell").nth(2)).to_contain_text("MN/m")


def test_both_methods_are_shown_against_each_other(page: Page) -> None:
    part(page, "Direct against inverse")
    table = page.get_by_role("region", name="Element by element")
    row = table.get_by_role("row").filter(has_text="k22").first
    expect(row).to_contain_text("MN/m")
    expect(row).to_contain_text(" ± ")
    expect(table).not_to_contain_text("+-")
    expect(page.get_by_role("img", name="Stiffness: 95 % intervals").locator("canvas").first).to_be_visible()


@pytest.mark.parametrize(
    ("title", "captions"),
    [
        ("Accelerances", ("Fig. 7: accelerance at 3y for a blow at 3y", "Fig. 8:", "Fig. 9:", "Fig. 9, phase")),
        ("Joints", ("Fig. 5: equations of the paper's method",)),
        ("Tester", ("Fig. 12: joint I, superposition", "Fig. 12: joint II")),
        ("Direct against inverse", ("Fig. 13: joint I, k22", "Fig. 13: joint II, k12", "Fig. 14: joint I, gamma22")),
    ],
)
def test_results_have_the_figures_of_the_report(page: Page, title: str, captions: tuple[str, ...]) -> None:
    part(page, title)
    for caption in captions:
        expect(page.get_by_role("img", name=caption).locator("canvas").first).to_be_visible()


def test_a_chart_is_saved_as_a_picture_and_a_table_as_csv(page: Page, campaign: Service) -> None:
    part(page, "Tester")
    for form, beginning in (("PNG", b"\x89PNG"), ("SVG", b"<svg")):
        with page.expect_download() as fetched:
            page.get_by_role("button", name=f"save k, joint I in shear as {form}").click()
        assert Path(fetched.value.path()).read_bytes().startswith(beginning)
    tables = page.locator('a[href^="/page/tables/"]')
    expect(tables).to_have_count(5)
    expect(tables.and_(page.locator('[target="_blank"][rel="noopener"]'))).to_have_count(5)  # an error has no STOP
    address = f"{campaign.address}/page/tables/1/dynamic_stiffness.csv"
    assert httpx.get(address).status_code == 401
    with campaign.browser() as browser:
        rows = list(csv.DictReader(io.StringIO(browser.get(address).text)))
    assert len(rows) == 36
    assert float(rows[0]["stiffness (N/m)"]) > 1e5
    assert float(rows[0]["loop_energy (J)"]) > 10 * float(rows[0]["loop_energy_se (J)"]) > 0
    assert float(rows[0]["reached_pp_mm (mm)"]) == pytest.approx(float(rows[0]["amplitude_pp_mm (mm)"]), rel=0.05)


def test_the_report_opens_with_every_figure(page: Page) -> None:
    page.get_by_role("button", name="Report", exact=True).click()
    link = page.get_by_role("link", name="Open run-1").first
    expect(link).to_be_visible()
    with page.expect_popup() as opened:
        link.click()
    expect(page.get_by_role("navigation", name="views")).to_be_visible()  # the page stays beside it
    report = opened.value
    assert report.evaluate("() => window.opener") is None
    for figure in ("Stabilisation", "Fig. 5", "Fig. 6", "Fig. 7", "Fig. 11", "Fig. 13", "Fig. 14"):
        expect(report.locator("figcaption").filter(has_text=figure).first).to_be_visible()
    report.emulate_media(media="print")
    report.set_viewport_size({"width": A4_BETWEEN_MARGINS, "height": 1000})
    too_wide = "() => [...document.querySelectorAll('.scroll')].filter((each) => each.scrollWidth > each.clientWidth)"
    assert report.evaluate(f"() => ({too_wide})().map((each) => each.innerText)") == []
    assert report.evaluate("() => document.documentElement.scrollWidth") == A4_BETWEEN_MARGINS
    scrolling = "() => [...document.querySelectorAll('.scroll')].map((each) => getComputedStyle(each).overflowX)"
    assert set(report.evaluate(scrolling)) == {"visible"}
    assert report.pdf(format="A4").startswith(b"%PDF")
    report.close()


def test_the_gap_says_where_which_and_how_far_and_opens_the_next_experiment(page: Page, diagnosis: int) -> None:
    page.get_by_role("link", name="Gap").click()
    page.get_by_role("link", name=f"diagnosis {diagnosis}").click()
    expect(page.locator("#verdict")).to_have_text("explained")
    expect(page.get_by_text("the gap falls from 12.3 % to 3.1 %")).to_be_visible()
    expect(page.get_by_text("right 8 of 9 times")).to_be_visible()
    expect(page.get_by_role("img", name="Accelerance: beam rig, blow at 3y, set 1").locator("canvas")).to_be_visible()
    page.get_by_label("Measured, before and after at").select_option(
        "elastomer tester, I, shear, 0.1 mm: 4.0 % to 1.0 %"
    )
    expect(page.get_by_role("img", name="Stiffness k: elastomer tester, I, shear").locator("canvas")).to_be_visible()
    expect(page.get_by_role("img", name="Accelerance: beam rig")).to_have_count(0)
    law = "joint stiffness falls by 20 % (90 %: 18 to 22) from 1.0 to 10 µm"
    expect(page.get_by_text(law)).to_be_visible()
    for quantity in ("Stiffness", "Loss factor"):
        drawn = page.get_by_role("img", name=f"{quantity}: joints that follow amplitude")
        expect(drawn.locator("canvas")).to_be_visible()
    ranking = page.get_by_role("region", name="Explanations")
    expect(ranking.get_by_role("row").nth(1)).to_contain_text("93.0 %")
    expect(page.get_by_role("region", name="Places")).to_contain_text("300 to 360 Hz")
    expect(page.get_by_role("img", name="Beam rig, level 1").locator("canvas").first).to_be_visible()
    expect(page.get_by_text("cannot tell apart")).to_be_visible()
    page.get_by_role("link", name="Open the sequence for it").click()
    expect(page.get_by_text("asks for this: turn the accelerometer")).to_be_visible()
    expect(page.get_by_label("Points to strike")).to_have_value("1y 3y 4y 5y 6y 7y 8y 9y 11y 1x 11x")
    steps = page.locator("#steps li")
    expect(steps).to_have_count(2)
    expect(steps.first).to_contain_text("by hand: Turn the accelerometer by 90 degrees")
    page.get_by_label("Points to strike").fill("1y 3y")
    page.get_by_label("Blows at each point").click()
    expect(steps.nth(1)).to_contain_text("10 blows at each of 1y, 3y (20 blows")


def test_filters_of_runs_stay_in_the_address(page: Page) -> None:
    page.get_by_role("link", name="Runs", exact=True).click()
    page.get_by_label("State").select_option("failed")
    page.get_by_role("button", name="Show").click()
    expect(page.get_by_text("No run fits.")).to_be_visible()
    assert "state=failed" in page.url
    page.reload()
    expect(page.get_by_label("State")).to_have_value("failed")


def test_a_specimen_has_a_history_at_each_point_of_the_tester(page: Page) -> None:
    page.get_by_role("link", name="Runs", exact=True).click()
    page.get_by_role("link", name="history").first.click()
    expect(page.get_by_text("A trend takes 3 runs at different times")).to_be_visible()
    page.get_by_role("combobox", name="Configuration").select_option("shear")
    page.get_by_label("Frequency (Hz)").select_option("180")
    page.get_by_role("button", name="Show").click()
    for caption in ("k, I in shear, 0.1 mm peak to peak, 180 Hz", "γ, I in shear", "Temperature"):
        expect(page.get_by_role("img", name=caption).locator("canvas").first).to_be_visible()
    table = page.get_by_role("region", name="I in shear, 0.1 mm peak to peak, 180 Hz")
    expect(table.get_by_role("row")).to_have_count(2)
    page.go_back()
    page.go_back()
    page.get_by_label("From").fill("2099-01-01")
    page.get_by_role("button", name="Show").click()
    expect(page.get_by_text("No run fits.")).to_be_visible()

"""`jointlab master`: the master curve of a specimen over frequency and temperature."""

from pathlib import Path
from typing import Annotated

import typer
from pydantic import ValidationError

from analysis.direct.shift_law import ShiftLaw
from api.commands.terminal import PICTURES, check_writable, open_catalogue, out, show_sections, write_json
from jointlab.documents.master import COLDEST, LOWEST_FREQUENCY, WARMEST, MasterQuestion
from jointlab.documents.stiffness import HIGHEST_FREQUENCY
from jointlab.errors import JointlabError
from jointlab.identification.master import specimen_master
from jointlab.identification.master_document import master_document
from jointlab.report.master import master_picture, master_section
from store.validation import faults_text


def master(
    article: Annotated[str, typer.Argument(help="The test article.")],
    specimen: Annotated[str, typer.Argument(help="The joint whose cylinders were tested, such as I.")],
    frequency: Annotated[
        list[float], typer.Option(min=LOWEST_FREQUENCY, max=HIGHEST_FREQUENCY, help="Hz; may be repeated.")
    ],
    temperature: Annotated[float, typer.Option(min=COLDEST, max=WARMEST, help="To predict at, degrees Celsius.")],
    reference: Annotated[
        float | None, typer.Option(min=COLDEST, max=WARMEST, help="Of the shift, by default the one to predict at.")
    ] = None,
    run: Annotated[
        list[int] | None, typer.Option(metavar="RUN", help="Only points of this run; may be repeated. By default all.")
    ] = None,
    configuration: Annotated[str | None, typer.Option(help="compression, shear or angled.")] = None,
    amplitude: Annotated[float | None, typer.Option(help="Commanded, mm peak to peak.")] = None,
    shift: Annotated[ShiftLaw, typer.Option(help="How frequencies shift with temperature.")] = ShiftLaw.WLF,
    wlf: Annotated[
        tuple[float, float] | None, typer.Option(help="Known C1 and C2 (K) at the reference temperature.")
    ] = None,
    vertical: Annotated[bool, typer.Option(help="Take stiffness in proportion to T in kelvin, as of rubber.")] = True,
    picture: Annotated[Path | None, typer.Option(help="Draw the curve to this file, .svg or .png.")] = None,
    json_file: Annotated[Path | None, typer.Option("--json", help="Write the answer to this file.")] = None,
) -> None:
    """Say k and gamma at a frequency beyond the tester's, from sweeps of a specimen at several temperatures.

    Cold rubber at a low frequency behaves as warm rubber at a high one. A fractional Zener law with shifts over
    temperature is fitted to the newest sine points of all runs of the specimen. Intervals hold 95 % and grow outside of
    the reduced frequencies that were measured, which the answer names. Of configuration and amplitude, where not given,
    those of most points are taken.

    For example: jointlab master "beam 3" I --frequency 1000 --temperature 23
    """
    check_writable(picture, json_file)
    try:
        question = MasterQuestion.model_validate(
            {
                "article": article,
                "specimen": specimen,
                "runs": run or (),
                "frequencies": frequency,
                "temperature_c": temperature,
                "reference_c": reference,
                "configuration": configuration,
                "amplitude_pp_mm": amplitude,
                "shift": shift,
                "wlf": None if wlf is None else dict(zip(("c1", "c2"), wlf, strict=True)),
                "vertical_shift": vertical,
            }
        )
    except ValidationError as error:
        raise JointlabError(faults_text(error.errors(), "question")) from error
    if picture is not None and picture.suffix.lower() not in PICTURES:
        raise JointlabError(f"--picture {picture}: the name is to end in {' or '.join(PICTURES)}")
    with open_catalogue() as catalogue:
        found = master_document(specimen_master(catalogue, question))
    show_sections([master_section(found)])
    if picture is not None:
        master_picture(found).savefig(picture)
        out.print(f"{picture} written")
    if json_file is not None:
        write_json(found.model_dump(mode="json"), json_file)

"""What the tests of CL files share: whole files of both dialects, and readings with and without the fast reader."""

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

from parakin.errors import InputError
from parakin.toolpath.reading.cl import reader as cl
from parakin.toolpath.reading.cl.motion import ClMotion
from parakin.toolpath.reading.cl.reader import read_cl

COLUMNS = ("tip", "axis", "line", "rapid", "feed", "spindle")
FAST = settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.fixture(autouse=True)
def without_feeds(monkeypatch):
    """These small texts are about other things than feeds; that no feed is no cut is in test_cl_dialects.py."""
    monkeypatch.setattr(ClMotion, "require_feed", lambda *_: None)


CATIA = """\
$$ -----------------------------------------------------------------
$$     Generated on Tuesday
$$     CATIA APT VERSION 1.0
$$*CATIA0
$$ Manufacturing Program.1
$$    0.00000    1.00000    0.00000   10.00000
$$    0.00000    0.00000    1.00000   20.00000
$$    1.00000    0.00000    0.00000   30.00000
PARTNO PART OPERATION.1
UNITS/MM
MULTAX
CUTTER/ 10.000000,  2.000000,  3.000000,  2.000000,  0.000000,$
         0.000000, 50.000000
LOADTL/3
PPRINT OPERATION NAME = A/B $$ aside
FEDRAT/ 1500.0000,MMPM
SPINDL/ 12000.0000,RPM,CLW
RAPID
GOTO  /    0.00000,    0.00000,   50.00000, 0.000000, 0.000000, 1.000000
GOTO  /   15.00000,    0.00000,    0.00000
AUTOPS
INDIRV/    0.00000,    1.00000,    0.00000
TLON,GOFWD/ (CIRCLE/    0.00000,    0.00000,    0.00000,$
   15.00000),ON,2,INTOF,$
 (LINE/    0.00000,    0.00000,    0.00000,$
    0.00000,   15.00000,    0.00000)
COOLNT/OFF
STOP
FINI
"""

NX = """\
TOOL PATH/FINISH,TOOL,MILL_D10
TLDATA/MILL,10.0000,1.5000,75.0000,0.0000,0.0000
MSYS/1.0000,2.0000,3.0000,0.0000000,1.0000000,0.0000000,0.0000000,0.0000000,1.0000000
$$ centerline data
PAINT/PATH
PAINT/SPEED,10
LOAD/TOOL,4,ADJUST,4
SPINDL/RPM,3600,CLW
PAINT/COLOR,186
RAPID
GOTO/-5.1250,3.4613,0.0000,0.0000000,0.0000000,1.0000000
PAINT/COLOR,31
FEDRAT/MMPM,250.0000
CIRCLE/-4.2750,3.4613,0.0000,0.0000000,0.0000000,1.0000000,0.8500,0.0600,0.5000,0.0000,0.0000
GOTO/-4.2750,4.3113,0.0000
GOTO/4.8775,4.3113,0.0000
PAINT/TOOL,NOMORE
END-OF-PATH
"""


def text_reader(folder):
    """A function that reads a text as a file of a folder."""

    def reads(text, **options):
        path = folder / "part.cl"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_cl(path, **options)

    return reads


def both_reader(folder, monkeypatch):
    """Through the kernel in tiny blocks and through the line reader; the same record or the same error, or it fails."""
    read = text_reader(folder)

    def reads(text, block=64, **options):
        results = []
        for bulk, size in ((0, block), (1 << 60, 1 << 20)):
            monkeypatch.setattr(cl, "_BULK_FROM", bulk)
            monkeypatch.setattr(cl, "_BLOCK", size)
            try:
                results.append(read(text, **options))
            except InputError as error:
                results.append(str(error))
        fast, slow = results
        if isinstance(slow, str) or isinstance(fast, str):
            assert fast == slow
            raise InputError(slow)
        for name in COLUMNS:
            np.testing.assert_array_equal(getattr(fast, name), getattr(slow, name), err_msg=name)
            assert getattr(fast, name).dtype == getattr(slow, name).dtype
        np.testing.assert_array_equal(fast.frame, slow.frame)
        for name in ("events", "notes", "tool", "dialect", "units"):
            assert getattr(fast, name) == getattr(slow, name)
        return slow

    return reads


def refused(read, text, line, *words, **options):
    """The file is refused at the line, in one line that has these words."""
    with pytest.raises(InputError) as caught:
        read(text, **options)
    message = str(caught.value)
    assert "\n" not in message
    assert caught.value.line == line, message
    assert message.startswith(caught.value.source + (f":{line}: " if line else ": "))
    for word in words:
        assert word in message
    return message


def notes(path):
    return [n.text for n in path.notes]

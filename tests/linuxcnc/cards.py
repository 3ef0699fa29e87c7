"""What the drivers of cards export, taken from their documents, and a component that exports it without a card.

- hm2_eth, hostmot2, sserial: their man pages of LinuxCNC 2.9; types and directions as in stepgen.c, inm.c, ssr.c,
  outm.c, pwmgen.c, watchdog.c and hm2_eth.c of src/hal/drivers/mesa-hostmot2. A 7I96S has 5 step generators, 11 inputs,
  4 relays (ssr) and 2 drivers (outm); a 7I76E 5 step generators and a 7I76 with 32 inputs and 16 outputs.
- hal_parport: its man page.
- lcec, cia402: documentation/cia402.md, src/cia402.c, src/devices/lcec_class_cia402*.[ch], lcec_class_din.c,
  lcec_class_dout.c, lcec_el41x2.c, documentation/master-pins.md of linuxcnc-ethercat.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

IN, OUT, IO = "IN", "OUT", "IO"


@dataclass
class Exports:
    """pins : name to (type, direction); params : name to type; functions : names"""

    pins: dict[str, tuple[str, str]] = field(default_factory=dict)
    params: dict[str, str] = field(default_factory=dict)
    functions: list[str] = field(default_factory=list)


def hostmot2(board, pwmgens):
    """A board of hm2_eth with five step generators."""
    e = Exports()
    e.functions += [f"{board}.{name}" for name in ("read", "write", "read-request", "read_gpio", "write_gpio")]
    for i in range(5):
        stepgen = f"{board}.stepgen.{i:02d}"
        for name in ("position-cmd", "velocity-cmd"):
            e.pins[f"{stepgen}.{name}"] = ("float", IN)
        for name in ("position-fb", "velocity-fb"):
            e.pins[f"{stepgen}.{name}"] = ("float", OUT)
        for name in ("enable", "control-type", "position-reset"):
            e.pins[f"{stepgen}.{name}"] = ("bit", IN)
        e.pins[f"{stepgen}.counts"] = ("s32", OUT)
        e.params |= {f"{stepgen}.{name}": "float" for name in ("position-scale", "maxvel", "maxaccel")}
        e.params |= {
            f"{stepgen}.{name}": "u32" for name in ("steplen", "stepspace", "dirsetup", "dirhold", "step_type")
        }
    for i in range(pwmgens):
        pwmgen = f"{board}.pwmgen.{i:02d}"
        e.pins |= {f"{pwmgen}.value": ("float", IN), f"{pwmgen}.enable": ("bit", IN)}
        e.params |= {f"{pwmgen}.scale": "float", f"{pwmgen}.output-type": "s32", f"{pwmgen}.offset-mode": "bit"}
    if pwmgens:
        e.params |= {f"{board}.pwmgen.pwm_frequency": "u32", f"{board}.pwmgen.pdm_frequency": "u32"}
    e.pins[f"{board}.watchdog.has_bit"] = ("bit", IO)
    e.params[f"{board}.watchdog.timeout_ns"] = "u32"
    return e


def mesa_7i96s(boards):
    e = Exports()
    for i in range(boards):
        board = f"hm2_7i96s.{i}"
        merge(e, hostmot2(board, pwmgens=1))
        for j in range(11):
            for name in (f"input-{j:02d}", f"input-{j:02d}-not", f"raw-input-{j:02d}", f"raw-input-{j:02d}-not"):
                e.pins[f"{board}.inm.00.{name}"] = ("bit", OUT)
            e.pins[f"{board}.inm.00.input-{j:02d}-slow"] = ("bit", IN)
        for kind, numbers in (("ssr", range(4)), ("outm", range(4, 6))):
            for j in numbers:
                e.pins[f"{board}.{kind}.00.out-{j:02d}"] = ("bit", IN)
                e.pins[f"{board}.{kind}.00.invert-{j:02d}"] = ("bit", IN)
    return e


def mesa_7i76e(boards):
    e = Exports()
    for i in range(boards):
        merge(e, hostmot2(f"hm2_7i76e.{i}", pwmgens=0))
        card = f"hm2_7i76e.{i}.7i76.0.0"
        for j in range(32):
            e.pins |= {f"{card}.input-{j:02d}": ("bit", OUT), f"{card}.input-{j:02d}-not": ("bit", OUT)}
        for j in range(16):
            e.pins[f"{card}.output-{j:02d}"] = ("bit", IN)
            e.params[f"{card}.output-{j:02d}-invert"] = "bit"
        e.pins |= {f"{card}.spindir": ("bit", IN), f"{card}.spinena": ("bit", IN), f"{card}.spinout": ("float", IN)}
        e.params |= {f"{card}.spinout-{name}": "float" for name in ("maxlim", "minlim", "scalemax")}
    return e


def parport(configuration):
    """Ports as loadrt's cfg tells, ``0 out 1 in``."""
    e = Exports()
    words = configuration.split()
    e.functions += ["parport.read-all", "parport.write-all"]
    for port, kind in enumerate(words[1::2]):
        inputs, outputs = (10, 11, 12, 13, 15), (1, 2, 3, 4, 5, 6, 7, 8, 9, 14, 16, 17)
        if kind == "in":
            inputs, outputs = (2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 15), (1, 14, 16, 17)
        e.functions += [f"parport.{port}.{name}" for name in ("read", "write", "reset")]
        e.params[f"parport.{port}.reset-time"] = "u32"
        for pin in inputs:
            e.pins |= {f"parport.{port}.pin-{pin:02d}-in{end}": ("bit", OUT) for end in ("", "-not")}
        for pin in outputs:
            e.pins[f"parport.{port}.pin-{pin:02d}-out"] = ("bit", IN)
            e.params |= {f"parport.{port}.pin-{pin:02d}-out-{name}": "bit" for name in ("invert", "reset")}
    return e


def ethercat(bus, axes):
    """The slaves of a bus's file, and cia402 with so many axes."""
    e = Exports(functions=["lcec.read-all", "lcec.write-all"])
    e.pins["lcec.0.all-op"] = ("bit", OUT)
    for kind, name in re.findall(r'<slave [^>]*type="(\w+)"[^>]* name="(\w+)"', bus):
        slave = f"lcec.0.{name}"
        if kind == "basic_cia402":
            e.pins |= {f"{slave}.srv-cia-controlword": ("u32", IN), f"{slave}.srv-cia-statusword": ("u32", OUT)}
            e.pins |= {f"{slave}.srv-opmode": ("s32", IN), f"{slave}.srv-opmode-display": ("s32", OUT)}
            e.pins |= {f"{slave}.srv-target-position": ("s32", IN), f"{slave}.srv-actual-position": ("s32", OUT)}
            e.pins |= {f"{slave}.srv-actual-velocity": ("s32", OUT)}
        elif kind == "EL1008":
            e.pins |= {f"{slave}.din-{i}{end}": ("bit", OUT) for i in range(8) for end in ("", "-not")}
        elif kind == "EL2008":
            e.pins |= {f"{slave}.dout-{i}": ("bit", IN) for i in range(8)}
        elif kind == "EL4102":
            for i in range(2):
                e.pins |= {f"{slave}.aout-{i}-{name}": ("bit", IN) for name in ("enable", "absmode")}
                e.pins |= {f"{slave}.aout-{i}-{name}": ("float", IO) for name in ("scale", "offset")}
                e.pins[f"{slave}.aout-{i}-value"] = ("float", IN)
        else:
            assert kind == "EK1100", kind
    for i in range(axes):
        axis = f"cia402.{i}"
        e.functions += [f"{axis}.read-all", f"{axis}.write-all"]
        e.pins |= {f"{axis}.statusword": ("u32", IN), f"{axis}.controlword": ("u32", OUT)}
        e.pins |= {f"{axis}.opmode-display": ("s32", IN), f"{axis}.opmode": ("s32", OUT)}
        e.pins |= {f"{axis}.drv-actual-{name}": ("s32", IN) for name in ("position", "velocity")}
        e.pins |= {f"{axis}.drv-target-{name}": ("s32", OUT) for name in ("position", "velocity")}
        e.pins |= {f"{axis}.{name}": ("bit", IN) for name in ("enable", "fault-reset")}
        e.pins |= {f"{axis}.{name}": ("float", IN) for name in ("pos-cmd", "velocity-cmd")}
        e.pins |= {f"{axis}.{name}": ("float", OUT) for name in ("pos-fb", "velocity-fb")}
        e.pins[f"{axis}.drv-fault"] = ("bit", OUT)
        e.params |= {f"{axis}.pos-scale": "float", f"{axis}.velo-scale": "float"}
        e.params |= {f"{axis}.auto-fault-reset": "bit", f"{axis}.csp-mode": "bit"}
    return e


def programs():
    """What LinuxCNC's own programs export, which don't run here: io and hal_manualtoolchange."""
    e = Exports()
    for name in (
        "user-enable-out",
        "user-request-enable",
        "coolant-flood",
        "coolant-mist",
        "tool-prepare",
        "tool-change",
    ):
        e.pins[f"iocontrol.0.{name}"] = ("bit", OUT)
    for name in ("emc-enable-in", "tool-prepared", "tool-changed"):
        e.pins[f"iocontrol.0.{name}"] = ("bit", IN)
    e.pins["iocontrol.0.tool-prep-number"] = ("s32", OUT)
    e.pins |= {"hal_manualtoolchange.number": ("s32", IN), "hal_manualtoolchange.change": ("bit", IN)}
    e.pins["hal_manualtoolchange.changed"] = ("bit", OUT)
    return e


def merge(one, other):
    one.pins |= other.pins
    one.params |= other.params
    one.functions += other.functions
    return one


def exports_of(files, name):
    """What the card's drivers export that a configuration's files ask for."""
    hal = files[f"{name}.hal"]
    if loaded := re.search(r'loadrt hm2_eth board_ip="([^"]*)" config="([^"]*)"', hal):
        boards = len(loaded[1].split(","))
        assert boards <= 4
        assert len(loaded[2].split(",")) == boards
        return mesa_7i96s(boards) if "hm2_7i96s" in hal else mesa_7i76e(boards)
    if loaded := re.search(r'loadrt hal_parport cfg="([^"]*)"', hal):
        return parport(loaded[1])
    axes = int(re.search(r"loadrt cia402 count=(\d+)", hal)[1])
    return ethercat(files[f"{name}_ethercat.xml"], axes)


def check_wiring(hal, exports):
    """Every pin, parameter and function of the card exists, and every signal has one source and one type."""
    mine = re.compile(r"^(hm2_|parport\.|lcec\.|cia402\.)")
    sources, types, joined = {}, {}, {}
    for line in hal.split("\n"):
        words = [word for word in line.split("#")[0].split() if word not in ("=>", "<=", "<=>")]
        if not words:
            continue
        if words[0] == "setp" and mine.match(words[1]):
            assert words[1] in exports.params or exports.pins.get(words[1], ("", OUT))[1] != OUT, line
        if words[0] == "addf" and mine.match(words[1]):
            assert words[1] in exports.functions, line
        if words[0] != "net":
            continue
        signal = words[1]
        for pin in (word for word in words[2:] if mine.match(word)):
            assert pin in exports.pins, line
            assert joined.setdefault(pin, signal) == signal, f"{pin} is joined to two signals"
            kind, direction = exports.pins[pin]
            assert types.setdefault(signal, kind) == kind, line
            if direction == OUT:
                assert sources.setdefault(signal, pin) == pin, f"{signal} has two sources"
    return joined


MOCK = """\
#include "rtapi.h"
#include "rtapi_app.h"
#include "hal.h"
MODULE_LICENSE("GPL");
static int id;
static const struct {{ const char *name; hal_type_t type; hal_pin_dir_t dir; }} pins[] = {{
{pins}
}};
static const struct {{ const char *name; hal_type_t type; }} params[] = {{
{params}
}};
static const char *functions[] = {{
{functions}
}};
static void nothing(void *arg, long period) {{ (void)arg; (void)period; }}
int rtapi_app_main(void)
{{
    unsigned i;
    id = hal_init("{name}");
    if (id < 0) return id;
    for (i = 0; i < sizeof pins / sizeof *pins; i++) {{
        void **place = hal_malloc(sizeof(void *));
        if (hal_pin_new(pins[i].name, pins[i].type, pins[i].dir, place, id)) return -1;
    }}
    for (i = 0; i < sizeof params / sizeof *params; i++) {{
        void *place = hal_malloc(8);
        if (hal_param_new(params[i].name, params[i].type, HAL_RW, place, id)) return -1;
    }}
    for (i = 0; i < sizeof functions / sizeof *functions; i++)
        if (hal_export_funct(functions[i], nothing, 0, 1, 0, id)) return -1;
    hal_ready(id);
    return 0;
}}
void rtapi_app_exit(void) {{ hal_exit(id); }}
"""


def write_mock(name, exports):
    """A component in C that exports all that, and does nothing."""
    types = {"bit": "HAL_BIT", "float": "HAL_FLOAT", "s32": "HAL_S32", "u32": "HAL_U32"}
    pins = [f'{{"{pin}", {types[kind]}, HAL_{way}}},' for pin, (kind, way) in exports.pins.items()]
    params = [f'{{"{param}", {types[kind]}}},' for param, kind in exports.params.items()]
    functions = [f'"{function}",' for function in exports.functions]
    return MOCK.format(
        name=name,
        pins="\n".join(pins),
        params="\n".join([*params, f'{{"{name}.unused", HAL_BIT}}']),
        functions="\n".join([*functions, f'"{name}.nothing"']),
    )

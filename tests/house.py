"""House rules of the package's source, all files at once: run as a script it prints what breaks them, rule by rule."""

import ast
from functools import cache
from pathlib import Path

import thermal_robot
from thermal_robot.effects import RANDOM, library

ROOT = Path(thermal_robot.__file__).parent
PACKAGE = "thermal_robot"
ORDER = (
    "arrays errors files percents compiling schema tables kinematics urdf_text robot shapes assembly maps paper "
    "campaign observables observations effects inference iso9283 prediction model_file correction simulation renderer "
    "diagnosis motion planning fleet diagnosing datasets report console streams blind viewer commands cli __main__"
).split()
"""Rooms from the ground up: each may import those before it."""
FREE = {
    "report": {"arrays", "errors", "files", "percents", "tables", "report"},
    "assembly": {"arrays", "errors", "compiling", "kinematics", "robot", "tables", "assembly"},
    "maps": {"arrays", "errors", "kinematics", "robot", "assembly", "maps"},
    "paper": {"arrays", "errors", "kinematics", "robot", "assembly", "paper"},
}
"""Rooms that may import less than what stands before them: one draws what it is given, three need no campaign."""
TYPES = {"report": {f"thermal_robot.diagnosis.{n}" for n in ("result", "values", "calibration", "crash")}}
TYPES["report"] |= {"thermal_robot.fleet.wear_result", "thermal_robot.shapes"}
TYPES["report"] |= {f"thermal_robot.motion.{n}" for n in ("result", "compare")}
"""What a room may know beyond that by type alone: the report sees values, and nothing that computes them."""
LONGEST_BODY = 40
"""Lines of a function: a screen."""
KNOWING = {"effects", "blind", "paper"}
"""Rooms that may know an effect by name: its own, the trial that withholds it, the paper's."""
FRAMES = {"campaign", "motion", "model_file.py", "robot.py", "cli.py"}
"""Rooms for which ``tool_frame`` and ``base_frame`` are frames, not effects."""
MODULES = sorted(ROOT.rglob("*.py"))


@cache
def tree(path):
    return ast.parse(path.read_text(encoding="utf-8"))


def room(module):
    """``thermal_robot.campaign.read`` stands in ``campaign``; the package itself in none."""
    return ".".join(module.split(".")[1:2])


def dotted(path):
    parts = [PACKAGE, *path.relative_to(ROOT).with_suffix("").parts]
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def is_module(name):
    top, *rest = name.split(".")
    path = ROOT.joinpath(*rest)
    return top == PACKAGE and (path.with_suffix(".py").is_file() or (path / "__init__.py").is_file())


def imports(node, how="top"):
    """Yield (module, how): ``checked`` under TYPE_CHECKING, ``lazy`` inside a function, else ``top``."""
    for child in (c for c in ast.iter_child_nodes(node) if not isinstance(c, ast.expr)):
        here = how
        if isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)) and how == "top":
            here = "lazy"
        if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
            yield from imports(ast.Module(child.body, []), "checked")
            yield from imports(ast.Module(child.orelse, []), how)
            continue
        if isinstance(child, ast.Import):
            yield from ((alias.name, here) for alias in child.names)
        elif isinstance(child, ast.ImportFrom):
            yield ("." * child.level) + (child.module or ""), here
            for alias in child.names:  # a module may be imported from its package
                if is_module(f"{child.module}.{alias.name}"):
                    yield f"{child.module}.{alias.name}", here
        yield from imports(child, here)


@cache
def imported():
    return {dotted(path): list(imports(tree(path))) for path in MODULES}


def long_bodies():
    for path in MODULES:
        for node in ast.walk(tree(path)):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                body = node.body[1:] if ast.get_docstring(node) else node.body
                lines = body[-1].end_lineno - body[0].lineno + 1 if body else 0
                if lines > LONGEST_BODY:
                    yield f"{dotted(path)}: {node.name} has {lines} lines"


def effects_known_elsewhere():
    every = {*library(), *RANDOM}
    for path in MODULES:
        here = path.relative_to(ROOT).parts[0]
        if here not in KNOWING and path.name != "__init__.py":
            names = every - ({"base_frame", "tool_frame"} if here in FRAMES else set())
            said = {n.value for n in ast.walk(tree(path)) if isinstance(n, ast.Constant) and isinstance(n.value, str)}
            yield from (f"{dotted(path)}: {name}" for name in said & names)


def imports_against_the_order():
    for own, found in imported().items():
        here = room(own)
        if here and here not in ORDER:
            yield f"{here} has no place in the order of rooms"
            continue
        for target, how in found:
            there, free = room(target), FREE.get(here)
            if not here or target.split(".")[0] != PACKAGE:
                wrong = target.startswith(".")
            elif how == "checked":
                wrong = free is not None and there not in free and target not in TYPES.get(here, {target})
            elif not there:  # the package itself: its version, and only once it is loaded
                wrong = how != "lazy"
            else:
                wrong = ORDER.index(there) > ORDER.index(here) or there not in (free or {there})
            if wrong:
                yield f"{own} imports {target}"


def imports_of_what_is_not_for_them():
    """The command line is for nobody, Pinocchio for kinematics, observations for effects by type, probability bare."""
    for own, found in imported().items():
        here, pure = room(own), own.startswith("thermal_robot.assembly.probability")
        for target, how in found:
            ours = target.split(".")[0] == PACKAGE
            if (
                (room(target) == "cli" and here not in ("cli", "__main__"))
                or (target.split(".")[0] == "pinocchio" and here != "kinematics")
                or (here == "effects" and room(target) == "observations" and how != "checked")
                or (
                    pure
                    and ours
                    and room(target) not in {"arrays", "errors", "compiling"}
                    and "probability" not in target
                )
            ):
                yield f"{own} imports {target}"


def circles(kinds=("top", "lazy", "checked")):
    """What a module loads never leads back to it; what it loads late, or knows by type, neither."""
    tops = {
        own: {t for t, how in found if how in kinds and is_module(t)} - {PACKAGE} for own, found in imported().items()
    }
    done, open_ = set(), []

    def visit(name):
        if name in open_:
            yield " → ".join([*open_[open_.index(name) :], name])
        elif name not in done:
            open_.append(name)
            for other in sorted(tops.get(name, ())):
                # a package stands for its public names: its own modules are loaded while it is
                if not name.startswith(other + "."):
                    yield from visit(other)
            open_.pop()
            done.add(name)

    for name in sorted(tops):
        yield from visit(name)


RULES = (
    long_bodies,
    effects_known_elsewhere,
    imports_against_the_order,
    imports_of_what_is_not_for_them,
    circles,
)

if __name__ == "__main__":
    for rule in RULES:
        print(rule.__name__.replace("_", " "), *(list(rule()) or ["none"]), sep="\n  ")

"""Records of a blind trial, made by hand."""

NOISE = 2e-5
_TRUE = ("unlisted", "places", "near", "quantities", "needs", "parameters")
J1, J2, L2 = ({"kind": k, "name": n} for k, n in (("joint", "j1"), ("joint", "j2"), ("link", "l2")))


def effect(name, p=0.99, status="found", places=(J1,), **more):
    rest = {"needs": [], "confounded_with": [], "locations": [{**p, "share": 0.5} for p in places], "parameters": []}
    return {"name": name, "status": status, "probability": p, **rest, **more}


def said(*effects, verdict=None, flagged=False, where=(), follows=(), advice="Nothing."):
    names = [e["name"] for e in effects if e["status"] == "found"] if verdict is None else verdict
    return {
        "gap": {"held_out": {"rms_before": 10 * NOISE, "rms_after": 2 * NOISE}},
        "verdict": {"effects": names, "probability": 0.9, "unexplained": flagged, "summary": "-"},
        "effects": list(effects),
        "unexplained": {
            "locations": [{**p, "probability": 0.6} for p in where],
            "depends_on": [{"covariate": c, "p_value": 1e-6} for c in follows],
        },
        "next": {"separates": [], "advice": advice, "samples": []},
    }


def record(kind, diagnosis, effects=(), parts=None, **more):
    """``parts``: ratios; an effect at work leaves three times the noise in joint j1 unless told otherwise."""
    ratios = {**dict.fromkeys(effects, 3.0), **(parts or {})}
    truth = {"effects": list(effects), "unlisted": None, "places": [], "quantities": [], "needs": [], "outliers": []}
    truth["parts"] = {n: {"ratio": r, "main": n in effects, "places": [J1]} for n, r in ratios.items()}
    truth |= {name: more.pop(name) for name in _TRUE if name in more}
    rest = {"id": "c1", "kind": kind, "robot": "ur3", "samples": 100, "measures": "position", "noise": NOISE}
    fresh = {"rms_before": 10 * NOISE, "rms_after": NOISE}
    rest |= {"without": [], "hidden": [], "fresh": fresh, "seconds": 0.5, "error": None}
    return {**rest, "truth": truth, "said": diagnosis, **more}


def crash(kind, *effects, **more):
    return record(kind, None, effects, error="the diagnosis failed: late", fresh=None, **more)


def trial():
    """Return records of every kind: 12 of them."""
    step = effect("discovered.1", quantity="time", shape="step")
    return [
        record("single", said(effect("drift")), ["drift"], id="a1"),
        record("single", said(effect("backlash"), effect("drift")), ["drift"], {"drift": 1.2}, id="a2", samples=40),
        record("single", said(flagged=True), ["backlash"], {"backlash": 0.8}, id="a3", robot="ur10", samples=35),
        crash("single", "backlash", id="a4"),
        record("null", said(), id="n1"),
        record("null", said(effect("joint_gain")), id="n2"),
        record("unlisted", said(step, flagged=True), unlisted="cable", places=[J1], quantities=["time"], id="u1"),
        record("hard", said(effect("drift")), ["drift"], {"drift": 1.4}, id="h1"),
        record("removed", said(flagged=True), ["drift"], without=["drift"], id="x1"),
        record("hidden", said(), ["drift"], needs=["time"], id="t1"),
        record("pair", said(effect("drift")), ["drift", "backlash"], id="p1"),
        record(
            "real", said(effect("geometric")), ["geometric"], right=True, asked="arm: untouched", answer="<geometric>"
        ),
    ]


def change(name, place, how, after, amount=1e-4):
    """What truly changes between campaigns."""
    joint = {"kind": "joint", "name": place}
    rest = {"how": how, "after": after, "amount": amount, "deviations": 4.0}
    return {"effect": name, "place": joint, "parameter": f"{name}, {place}", **rest}


def alarm(name, place, kind, after=None, size=1e-4, std=1e-5, span=None):
    """A parameter that rings."""
    early, late = span or (after, None if after is None else after + 1)
    jump = {"after": after, "earliest": early, "latest": late} if kind == "jump" else None
    told = {"effect": name, "place": place, "parameter": f"{name}, {place}", "alarm": True, "kind": kind}
    return {**told, "jump": jump, "change": size, "change_std": std}


def together(kind, diagnosis, true, effects=("joint_offset",), **more):
    """A record of several campaigns."""
    truth = {"effects": list(effects), "unlisted": None, "outliers": [], **true}
    rest = {"id": "s1", "kind": kind, "robot": "ur3", "samples": 200, "measures": "position", "noise": NOISE}
    rest |= {"without": [], "hidden": [], "fresh": None, "seconds": 9.0, "error": None}
    return {**rest, "truth": truth, "said": diagnosis, **more}


def compared(kind, told, *changes, named=("joint_offset",), **more):
    """Two campaigns, and what is told to have changed: effects and places."""
    diagnosis = {"verdict": {"effects": list(named)}, "changes": [{"effect": e, "place": p} for e, p in told]}
    return together(kind, diagnosis, {"campaigns": 2, "changes": list(changes)}, **more)


def series(kind, rings, *changes, **more):
    """Twelve campaigns, and what rings."""
    quiet = {**alarm("joint_offset", "j9", "constant"), "alarm": False}
    return together(kind, {"parameters": [*rings, quiet]}, {"campaigns": 12, "changes": list(changes)}, **more)


def told_shared(what, group=None):
    """A parameter that is called shared: by all, or as differing between two halls."""
    other = {"hall 1": "hall 2", "hall 2": "hall 1"}
    groups = [{"group": other[group], "mean": 1e-6}, {"group": group, "mean": -1e-3}] if group else []
    return {
        "effect": what["effect"],
        "parameter": what["parameter"],
        "label": "hall" if group else "",
        "groups": groups,
    }


def fleet(true, own, told, gathered=(), apart=(), found=(), **more):
    """A small fleet."""
    diagnosis = {"shared": list(told), "gathered": list(gathered), "apart": list(apart), "found": list(found)}
    return together("fleet", diagnosis, {"campaigns": 10, "shared": list(true), "own": list(own)}, **more)


def failed_together(kind, **more):
    """A case of several campaigns without an answer."""
    lost = {"error": "the diagnosis failed: late", "seconds": None, **more}
    if kind == "fleet":
        place = {"effect": "backlash", "parameter": "lost motion, j1", "place": J1}
        return {**fleet([{**place, "group": None}], [{**place, "robot": "r1"}], []), "said": None, **lost}
    if kind in ("same", "steady"):
        return {**(compared if kind == "same" else series)(kind, []), "said": None, **lost}
    made = {"changed": (compared, "changes"), "series": (series, "jumps")}[kind]
    return {**made[0](kind, [], change("joint_offset", "j1", made[1], 0)), "said": None, **lost}


def trial_of_several():
    """Return records of several campaigns: 7 of them, of which 3 are wrong."""
    jumps, grows = change("backlash", "j1", "jumps", 4), change("backlash", "j1", "grows", None)
    place = {"effect": "joint_gain", "parameter": "gain error, j2", "place": J2}
    return [
        compared("same", [], id="k1"),
        compared("changed", [("joint_offset", "j1")], change("joint_offset", "j1", "changes", 0), id="k2"),
        series("steady", [alarm("backlash", "j1", "walk")], id="k3"),
        series("series", [alarm("backlash", "j1", "jump", 4)], jumps, id="k4"),
        series("series", [alarm("backlash", "j1", "jump", 4)], grows, id="k5"),
        fleet([{**place, "group": "hall 2"}], [], [told_shared(place, "hall 2")], id="k6"),
        failed_together("fleet", id="k7"),
    ]

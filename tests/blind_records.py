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

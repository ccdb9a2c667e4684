"""Studies that are run for tests: one small, of single grains in all regimes and a pile."""

from pathlib import Path

from orchestrator import plan, tables
from orchestrator.report.results import Results
from orchestrator.runs import engine, reuse
from orchestrator.study import study
from tests.waiting import HANGS_S

TITLE = """<script>alert(1)</script> & "sand" d'été"""
TEXT = f"""title = '''{TITLE}'''
method.grains = {{ load_increment = 0.02, waiting_time = 6.0 }}
forces = {{ law = "paper" }}
fluid = {{ kind = "paper" }}

[[group]]
name = "horizontal"
[group.axes]
"bed.entrainment_angle_deg" = [45.0, 60.0]
"bed.roughness" = ["d/10", "d/30"]
"fluid.viscosity" = [1e-5, 1e-3]
"grain.diameter" = [5e-5, 2e-4, 1e-3]

[[group]]
name = "slope"
bed = {{ slope_deg = 15.0 }}
[group.axes]
"grain.diameter" = [5e-5, 2e-4, 1e-3]

[[group]]
name = "pile"
bed = {{ kind = "pile", slope_deg = 15.0, height = 0.01 }}
method.grains = {{ mobile_layers = 1, load_increment = 0.03 }}
grain = {{ diameter = 1e-3 }}
# </pre><b>
"""


def run(out: Path, text: str = TEXT) -> Results:
    """Run what is missing of it, or of another study, in a directory."""
    cases = out / "cases"
    cases.mkdir(parents=True, exist_ok=True)
    asked = study.parse(text, name="small", where="test")
    planned = plan.make(asked, cases=cases)
    done = reuse.done(planned.cases, cases)
    todo = {name: one for name, one in planned.cases.items() if name not in done}
    with engine.local(cases, workers=2, limit_s=HANGS_S) as pool:
        assert not engine.run(todo, pool, lambda *_: None)
    made = tables.make_tables(asked, planned, cases, reuse.done(planned.cases, cases))
    return Results(asked, planned, made, cases)

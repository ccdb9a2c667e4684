"""LAMMPS behind the door of a benchmark pack:  python solve.py CASE OUT

Copies the decks beside this file to the working directory, writes the parameters, runs ``lmp``
there and turns what it wrote into an answer. Kinds: collision, incline, sliding, passing, pivot,
pile.
"""

import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import door

# one process needs no MPI daemon and no search for fast networks, which take 0.3 s, and no
# directory that all such processes of a user share: one removes it while another starts
ENVIRONMENT = {
    "OMPI_MCA_ess_singleton_isolated": "1",
    "OMPI_MCA_orte_create_session_dirs": "0",
    "OMPI_MCA_pml": "ob1",
}
CHECKS = {
    "collision": ("speed_m_s",),
    "incline": ("incline_deg",),
    "sliding": ("speed_m_s",),
    "passing": ("force_n", "displacement_criterion"),
}


def parameters(scene):
    """The variables of every deck."""
    return {
        "diameter": scene["d_m"],
        "density": scene["rho_sol_kg_m3"],
        "mass": scene["mass_kg"],
        "gravity": scene["reduced_gravity_m_s2"],
        "spring": scene["spring_n_m"],
        "damping": scene["damping"],
        "friction": math.tan(math.radians(scene["phi_deg"])),
        "dt": scene["time_step"] * math.sqrt(scene["mass_kg"] / scene["spring_n_m"]),
    }


def bed_parameters(bed, step):
    """The variables of the deck for beds."""
    unit = bed.scene["time_unit_s"]
    sample = int(door.SAMPLING_INTERVAL * unit / step + 0.5)
    slope, x, z = bed.roof
    return {
        "counted": bed.counted,
        "sampling_steps": sample,
        "settle_steps": int(door.SETTLE / door.SAMPLING_INTERVAL + 0.5) * sample,
        "settle_drag": bed.settle_drag,
        "rest_energy": bed.rest_energy,
        "away": door.AWAY,
        "behind": bed.behind,
        "waiting_samples": int(
            bed.scene["waiting_time"] / door.SAMPLING_INTERVAL + 0.5
        ),
        "load_steps": len(bed.load_steps) - 1,
        "displacement_criterion": bed.scene["displacement_criterion"],
        "roof_x": math.sin(slope),
        "roof_z": math.cos(slope),
        "ceiling_x": x,
        "ceiling_z": z,
    }


def write_variables(path, values):
    """Write a file of LAMMPS variables."""
    lines = (
        f"variable        {name} index {value!r}\n" for name, value in values.items()
    )
    path.write_text("".join(lines))


def write_bed(bed, folder):
    """Write the grains, and the force on each for every load step."""
    d, rho = bed.scene["d_m"], bed.scene["rho_sol_kg_m3"]
    kinds = {"fixed": 1, "mobile": 2, "counted": 3, "pushed": 3}
    places = [(float(row["x_m"]), float(row["z_m"])) for row in bed.grains]
    margin = door.BOX * d
    lines = ["grains", "", f"{len(places)} atoms", "3 atom types", ""]
    for axis, values in zip("xz", zip(*places, strict=True), strict=True):
        lines.append(
            f"{min(values) - margin!r} {max(values) + margin!r} {axis}lo {axis}hi"
        )
    lines += [f"{-margin!r} {margin!r} ylo yhi", "", "Atoms  # sphere", ""]
    for number, (row, (x, z)) in enumerate(zip(bed.grains, places, strict=True), 1):
        lines.append(
            f"{number} {kinds[row['kind']]} {row['d_m']} {rho!r} {x!r} 0.0 {z!r}"
        )
    (folder / "grains.data").write_text("\n".join(lines) + "\n")
    for place, axis in enumerate("xz"):
        rows = (f"{number} {way[place]!r}\n" for number, way in enumerate(bed.along, 1))
        (folder / f"along.{axis}.txt").write_text(f"{bed.counted}\n{''.join(rows)}")
    with (
        (folder / "force.x.txt").open("w") as fx,
        (folder / "force.z.txt").open("w") as fz,
    ):
        # LAMMPS reads one set more than it uses
        for load_step in (*range(len(bed.load_steps)), len(bed.load_steps) - 1):
            for stream, axis in ((fx, 0), (fz, 1)):
                stream.write(f"{len(places)}\n")
                for number, force in enumerate(bed.force(load_step), 1):
                    stream.write(f"{number} {force[axis]!r}\n")


def moved_in(bed, folder):
    """The load step in which each counted grain moved or was gone; whether it was gone."""
    samples = [int(line) for line in (folder / "samples.csv").read_text().split()[1:]]
    frames = (folder / "track.dump").read_text().split("ITEM: TIMESTEP\n")[1:]
    rows = [[line.split() for line in frame.splitlines()[8:]] for frame in frames]
    found = [{int(a): (float(x), float(z)) for a, x, z in frame} for frame in rows]
    start, marker = found[0], bed.scene["displacement_criterion"] * bed.scene["d_m"]
    first, gone = [0] * bed.counted, [False] * bed.counted
    for load_step, frame in zip(samples, found[1:], strict=True):
        for number in range(1, bed.counted + 1):
            now = frame.get(number)
            along = bed.along[number - 1]
            if first[number - 1] == 0 and (
                now is None or _far(start[number], now, along) >= marker
            ):
                first[number - 1], gone[number - 1] = load_step, now is None
    return first, gone


def _far(start, now, along):
    return sum(a * (b - c) for a, b, c in zip(along, now, start, strict=True))


def run(deck, *variables):
    """Run LAMMPS on a deck in the working directory."""
    command = ["lmp", "-in", deck, "-nocite", "-log", "none", *variables]
    with open("log.txt", "w") as log:
        code = subprocess.call(
            command, stdout=log, stderr=log, env={**os.environ, **ENVIRONMENT}
        )
    if code != 0:
        said = Path("log.txt").read_text().splitlines()
        sys.exit("\n".join(line for line in said if line.startswith("ERROR")))


def check(kind, scene):
    """One of the decks for the contact law."""
    given = [("-var", key.partition("_")[0], repr(scene[key])) for key in CHECKS[kind]]
    run(f"in.{kind}", *(word for words in given for word in words))
    rows = [line.split(",") for line in Path("answer.csv").read_text().split()]
    found = {(quantity, at): float(value) for quantity, at, value in rows}
    return lambda quantity, at: found[quantity, at]


def steps(folder):
    """The time steps of a run: those of the last sample of the grains."""
    return int(
        (folder / "track.dump").read_text().split("ITEM: TIMESTEP\n")[-1].split()[0]
    )


def main(case, out):
    """Answer one scene."""
    scene = json.loads((case / "scene.json").read_text())
    kind = scene["kind"]
    if kind not in (*CHECKS, "pivot", "pile"):
        print(f"LAMMPS is not asked for the kind {kind}", file=sys.stderr)
        return 2
    folder = Path("lammps")
    shutil.copytree(HERE, folder, dirs_exist_ok=True)
    values = parameters(scene)
    bed = None if kind in CHECKS else door.Bed(case)
    if bed:
        values["dt"] = bed.step
    write_variables(folder / "parameters.lammps", values)
    os.chdir(folder)
    if bed is None:
        answer, took = check(kind, scene), None
    else:
        write_variables(Path("bed.lammps"), bed_parameters(bed, bed.step))
        write_bed(bed, Path())
        run("in.bed")
        answer, took = bed.answer(*moved_in(bed, Path())), steps(Path())
    door.write(case, out, answer, took)
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).absolute(), Path(sys.argv[2]).absolute()))

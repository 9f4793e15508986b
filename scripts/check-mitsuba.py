"""The one-feature scenes of tests/mitsuba, as Mitsuba 3 renders them.

    check-mitsuba.py record [SCENE...]   renders the scenes (default: all) and writes their block means and standard
                                         errors into tests/mitsuba/references.txt; others keep theirs
    check-mitsuba.py again               renders all with other random numbers and compares with what is recorded

A scene is named by its path below tests/mitsuba, without ".xml". Needs mitsuba (scripts/check-mitsuba.sh makes a Python
that has it). Block means are of 4 x 4 pixels, errors from BATCHES renders with seeds of their own.
"""
import pathlib
import sys

import mitsuba
import numpy

mitsuba.set_variant("scalar_rgb")

FOLDER = pathlib.Path(__file__).resolve().parent.parent / "tests" / "mitsuba"
TABLE = FOLDER / "references.txt"
BATCHES, SAMPLES, BLOCK = 32, 256, 4
HEAD = """# Block means of tests/mitsuba/*/*.xml as Mitsuba %s renders them: scripts/check-mitsuba.py record.
# scene, blocks in a row, rows; then a block a line, rows from above: R G B and their standard errors
"""


def names():
    return sorted(str(path.relative_to(FOLDER).with_suffix("")) for path in FOLDER.glob("*/*.xml"))


def blocks(name, first_seed):
    """Means and standard errors, [row, column, (R G B)]."""
    scene = mitsuba.load_file(str(FOLDER / (name + ".xml")))
    batches = []
    for batch in range(BATCHES):
        image = numpy.array(mitsuba.render(scene, spp=SAMPLES, seed=first_seed + batch))[:, :, :3]
        rows, columns = image.shape[0] // BLOCK, image.shape[1] // BLOCK
        batches.append(image.reshape(rows, BLOCK, columns, BLOCK, 3).mean(axis=(1, 3)))
    batches = numpy.array(batches, dtype=numpy.float64)
    return batches.mean(axis=0), batches.std(axis=0, ddof=1) / BATCHES**0.5


def read():
    table, name = {}, None
    for line in TABLE.read_text().splitlines() if TABLE.exists() else []:
        words = line.split()
        if line.startswith("#"):
            continue
        if len(words) == 3:
            name, columns, rows = words[0], int(words[1]), int(words[2])
            table[name] = (columns, rows, [])
        else:
            table[name][2].append([float(word) for word in words])
    return table


def write(table):
    with open(TABLE, "w") as file:
        file.write(HEAD % mitsuba.__version__)
        for name in names():
            if name not in table:
                continue
            columns, rows, lines = table[name]
            file.write("%s %d %d\n" % (name, columns, rows))
            for line in lines:
                file.write(" ".join("%.6g" % value for value in line[:3]) + " " +
                           " ".join("%.2g" % value for value in line[3:]) + "\n")


def record(wanted):
    table = read()
    for name in wanted or names():
        mean, error = blocks(name, 1)
        rows, columns = mean.shape[:2]
        lines = numpy.concatenate([mean, error], axis=2).reshape(rows * columns, 6)
        table[name] = (columns, rows, lines.tolist())
        print("%-40s mean %s, error of a block %.2f %%" %
              (name, mean.mean(axis=(0, 1)), 100 * numpy.sqrt((error**2).mean()) / mean.mean()), flush=True)
        write(table)


def again():
    table, values, far, worst = read(), 0, 0, 0.0
    for name in names():
        mean, error = blocks(name, 1 + BATCHES)
        recorded = numpy.array(table[name][2]).reshape(mean.shape[0], mean.shape[1], 6)
        spread = numpy.sqrt(error**2 + recorded[:, :, 3:]**2) + 1e-6 * (1 + abs(mean))
        z = abs(mean - recorded[:, :, :3]) / spread
        values, far, worst = values + z.size, far + (z > 3.3).sum(), max(worst, z.max())
        print("%-40s largest |z| %.2f" % (name, z.max()))
    print("%d values, %d with |z| > 3.3, largest %.2f" % (values, far, worst))
    return 0 if far <= 0.01 * values and worst < 6 else 1


if __name__ == "__main__":
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    if len(sys.argv) > 1 and sys.argv[1] == "record":
        sys.exit(record(sys.argv[2:]))
    if sys.argv[1:] == ["again"]:
        sys.exit(again())
    sys.exit(__doc__)

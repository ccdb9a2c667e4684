# Whether the mesh is that which parameters speaks of; says what differs, and exits with 1:
#
#   cd constant/polyMesh && awk -f ../../agree.awk ../../parameters points boundary
#
# Speeds and the wall's law are made of heights in parameters that the mesh has, too.

function abs(x) { return x < 0 ? -x : x }
function complain(name, value, found) {
    printf "Allrun: %s is %s in parameters and %s in the mesh: change both, see README.md\n", name, value, found
    is_wrong = 1
}

FILENAME ~ /parameters$/ { sub(/;.*/, "", $2); value[$1] = $2; next }
FILENAME == "points" && /^\(.+\)$/ {
    gsub(/[()]/, "")
    x = $1 + 0; y = $2 + 0; z = $3 + 0
    if (!some || z > lid) lid = z
    # the two lowest points of the first edge: the lower and the upper end of its first cell
    if (!some || x < first || x == first && y < side) { first = x; side = y; low = high = z; count = 1 }
    else if (x == first && y == side) {
        count++
        if (z < low) { high = low; low = z }
        else if (count == 2 || z < high) high = z
    }
    some = 1
}
FILENAME == "boundary" {
    # a patch stands on one line or on several
    if ($0 ~ /^ *[a-z]+ *([{].*)?$/) patch = $1
    if (patch == "lid" && match($0, /type +[a-z]+/)) is_wall = substr($0, RSTART, RLENGTH) ~ /wall$/
    if (patch == "sides" && match($0, /type +[a-z]+/)) is_plane = substr($0, RSTART, RLENGTH) ~ /empty$/
    if (patch == "inlet" && match($0, /offset [(][^ ]*/)) offset = substr($0, RSTART + 8, RLENGTH - 8)
}

END {
    if (abs(lid - value["lidHeight"]) > 1e-4 * lid) complain("lidHeight", value["lidHeight"], lid)
    centre = (high - low) / 2
    if (abs(centre - value["firstCentre"]) > 1e-3 * centre)
        complain("firstCentre", value["firstCentre"], centre)
    if (abs(offset - value["approachOffset"]) > 1e-4 * abs(offset))
        complain("approachOffset", value["approachOffset"], offset)
    if ((value["top"] == "closed") != is_wall)
        complain("top", value["top"], is_wall ? "closed" : "not closed")
    if ((value["sides"] == "empty") != is_plane)
        complain("sides", value["sides"], is_plane ? "empty" : "not empty")
    exit is_wrong
}

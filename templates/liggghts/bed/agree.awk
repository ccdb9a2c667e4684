# Whether grains.data holds the grains that parameters.liggghts speaks of; says what differs, and
# exits with 1:
#
#   awk -f agree.awk parameters.liggghts grains.data
#
# LIGGGHTS reads the diameter and the density of each grain from grains.data. Contact law, units and
# time step are made of the parameters.

function differ(one, other) { return one - other > 1e-6 * other || other - one > 1e-6 * other }
function complain(name, value, found) {
    printf "Allrun: %s is %s in parameters.liggghts and %s in grains.data: ", name, value, found
    print "change both, see README.md"
    is_wrong = 1
}

FILENAME == "parameters.liggghts" && $3 == "equal" { value[$2] = $4 }
FILENAME == "parameters.liggghts" { next }
$3 == "ylo" { across = $2 - $1 }
atoms && NF > 1 {
    if (!all || $3 + 0 < all) all = $3 + 0
    if ($2 > 1 && (!mobile || $3 + 0 < mobile)) mobile = $3 + 0
    if (differ($4, value[heavy])) density = $4
}
$1 == "Atoms" {
    atoms = 1
    heavy = "density" in value ? "density" : "grain_density"
}

END {
    if (density != "") complain(heavy, value[heavy], density)
    # a mixture has the diameter of its smallest grain: of those that may move, or of all
    least = value["diameter"] * ("smallest" in value ? value["smallest"] : 1)
    if (differ(mobile, least) && differ(all, least))
        complain("the diameter of the smallest grain", least, mobile)
    if (value["width"] > 0 && differ(across, value["width"] * value["diameter"]))
        complain("the width of the strip in m", value["width"] * value["diameter"], across)
    exit is_wrong
}

# Prints the field wallShearStress of an iteration: the stress of the bed on the flow
# over the density,
#
#   n & (nu + nut) dev(twoSymm(grad(U))),   m2/s2,
#
# with n the unit normal of a face of the bed out of the flow:
#
#   awk -v time=78 -v nu=1e-05 -f wallShearStress.awk >78/wallShearStress
#
# The numbers are those of OpenFOAM's function object of that name, which cannot be used
# everywhere: OpenFOAM 1912 of Debian 13, built with gcc 14, ends with an error in
# IOstream "sha1" as soon as it reads any function object.
#
# As in OpenFOAM, gradients are by "Gauss linear", and on the bed grad(U) is that of the
# cell with the part along n replaced by snGrad(U): gaussGrad::correctBoundaryConditions.
# The mesh is one cell thick along y: a cell is a polygon in x and z, and a face is a side
# of it. Lengths of sides and areas of polygons stand for areas and volumes.
#
# Writes besides what a study reads of the flow, with six digits, which the fields of all
# processors share: bed_flow.csv has for each face of the bed the stress of the flow on it
# over the density and the velocity in the cell on it, both along the face and positive
# downstream; column_flow.csv has the mean velocity in the column before the inlet.

BEGIN {
    # the items of the lists are lines such as "4(0 1 23 22)" and "(0.1 0 0.2)"
    between = "[ ()]+"
    mesh = "constant/polyMesh/"
    read_patches(mesh "boundary")
    read_list(mesh "owner", "", owner)
    inner_faces = read_list(mesh "neighbour", "", neighbour)
    read_list(mesh "faces", "", corners)
    read_list(mesh "points", "", points)
    read_list(time "/U", "internalField", velocity)
    bed_faces = read_list(time "/nut", "bed", nut)

    find_cells()
    for (cell in measured)
        measure(cell)
    for (patch in touched)
        set_velocity_on(patch)

    print_head()
    for (i = 0; i < bed_faces; i++)
        print_stress(start["bed"] + i, nu + nut[i])
    print ")\n;\n    }\n}\n\n// ************************************************ //"
    write_bed_flow("bed_flow.csv")
    write_column_flow("column_flow.csv")
}

# Read the patches: their names in their order, types, first faces and numbers of faces.
function read_patches(file,    line, text, words, i, patch) {
    while ((getline line <file) > 0) {
        if (line == "(")
            text = ""
        text = text " " line
    }
    gsub(/[{};]/, " & ", text)
    split(text, words, " ")
    for (i = 2; i in words; i++) {
        if (words[i] == "{") {
            patch = words[i - 1]
            patches = patches " " patch
        }
        if (words[i - 1] == "type")
            type[patch] = words[i]
        if (words[i - 1] == "startFace")
            start[patch] = words[i]
        if (words[i - 1] == "nFaces")
            size[patch] = words[i]
    }
    if (!("bed" in start))
        fail(file ": there is no patch named bed")
}

# Read the lines of the first list of a file, or of the first one behind a line that
# begins with some word; their number.
function read_list(file, word, lines,    line, words, before, count) {
    while (words[1] != word && (getline line <file) > 0)
        split(line, words, " ")
    while (line != "(" && (getline line <file) > 0)
        if (line != "(")
            before = line
    count = 0
    while ((getline line <file) > 0 && line != ")")
        lines[count++] = line
    close(file)
    if (line != ")" || count != before + 0)
        fail("the results are not whole: " file)
    return count
}

# Find the cells whose centres are needed, and the sides of each: the cells on the bed,
# and for the interpolation to their sides those beside them.
function find_cells(    i, face, patch) {
    for (i = 0; i < bed_faces; i++)
        on_bed[owner[start["bed"] + i]] = 1
    for (face = 0; face < inner_faces; face++)
        if (owner[face] in on_bed || neighbour[face] in on_bed) {
            measured[owner[face]] = 1
            measured[neighbour[face]] = 1
        }
    for (face = 0; face < inner_faces; face++) {
        add_side(owner[face], face)
        add_side(neighbour[face], face)
    }
    for (patch in start) {
        if (type[patch] == "empty")
            continue
        for (face = start[patch]; face < start[patch] + size[patch]; face++) {
            add_side(owner[face], face)
            if (owner[face] in on_bed)
                touched[patch] = 1
        }
    }
}

function add_side(cell, face) {
    if (cell in measured)
        sides[cell] = sides[cell] " " face
}

# Set the velocity on the faces of a patch.
function set_velocity_on(patch,    values, i, face) {
    if (type[patch] != "wall" && type[patch] != "cyclic")
        read_list(time "/U", patch, values)
    for (i = 0; i < size[patch]; i++) {
        face = start[patch] + i
        if (type[patch] == "wall")
            velocity_on[face] = "(0 0 0)"
        else if (type[patch] == "cyclic")
            # the column before the inlet is one cell long: what leaves it enters it
            velocity_on[face] = velocity[owner[face]]
        else
            velocity_on[face] = values[i]
    }
}

# Find the ends of a face in x and z, and its centre.
function measure_face(face,    at, one, other, i, away, farthest) {
    split(corners[face], at, between)
    split(points[at[2]], one, between)
    x1[face] = one[2]
    z1[face] = one[4]
    # of the other corners one is beside the first, and two are at the other end
    for (i = 3; i <= 5; i++) {
        split(points[at[i]], other, between)
        away = (other[2] - one[2]) ^ 2 + (other[4] - one[4]) ^ 2
        if (away > farthest) {
            farthest = away
            x2[face] = other[2]
            z2[face] = other[4]
        }
    }
    face_x[face] = (x1[face] + x2[face]) / 2
    face_z[face] = (z1[face] + z2[face]) / 2
}

# Find the area of a cell and its centre, from triangles about the mean of its sides.
function measure(cell,    side, count, i, face, x, z, part) {
    count = split(sides[cell], side, " ")
    for (i = 1; i <= count; i++) {
        measure_face(side[i])
        x += face_x[side[i]] / count
        z += face_z[side[i]] / count
    }
    for (i = 1; i <= count; i++) {
        face = side[i]
        part = (x1[face] - x) * (z2[face] - z) - (x2[face] - x) * (z1[face] - z)
        if (part < 0)
            part = -part
        area[cell] += part / 2
        cell_x[cell] += part / 2 * (x + x1[face] + x2[face]) / 3
        cell_z[cell] += part / 2 * (z + z1[face] + z2[face]) / 3
    }
    cell_x[cell] /= area[cell]
    cell_z[cell] /= area[cell]
}

# Set nx and nz to the normal of a face out of a cell, as long as the face.
function find_normal(face, cell,    out) {
    nx = z2[face] - z1[face]
    nz = x1[face] - x2[face]
    out = nx * (face_x[face] - cell_x[cell]) + nz * (face_z[face] - cell_z[cell])
    if (out < 0) {
        nx = -nx
        nz = -nz
    }
}

# Set u and w to the velocity on a face: between two cells it is linear.
function find_velocity(face,    one, other, at, beyond, to_one, to_other, part) {
    if (face >= inner_faces) {
        split(velocity_on[face], at, between)
        u = at[2]
        w = at[4]
        return
    }
    one = owner[face]
    other = neighbour[face]
    find_normal(face, one)
    to_one = nx * (face_x[face] - cell_x[one]) + nz * (face_z[face] - cell_z[one])
    to_other = nx * (cell_x[other] - face_x[face]) + nz * (cell_z[other] - face_z[face])
    part = to_other / (to_one + to_other)
    split(velocity[one], at, between)
    split(velocity[other], beyond, between)
    u = part * at[2] + (1 - part) * beyond[2]
    w = part * at[4] + (1 - part) * beyond[4]
}

# Set g_xx, g_xz, g_zx and g_zz to the gradient of the velocity in a cell; g_xz is that of
# w along x.
function find_gradient(cell,    side, count, i) {
    g_xx = 0
    g_xz = 0
    g_zx = 0
    g_zz = 0
    count = split(sides[cell], side, " ")
    for (i = 1; i <= count; i++) {
        find_velocity(side[i])
        find_normal(side[i], cell)
        g_xx += nx * u / area[cell]
        g_xz += nx * w / area[cell]
        g_zx += nz * u / area[cell]
        g_zz += nz * w / area[cell]
    }
}

# Print the stress of a face of the bed, where the effective viscosity is nu_eff.
function print_stress(face, nu_eff,
                      cell, length_, at, out, more_x, more_z, third, x, z) {
    cell = owner[face]
    find_gradient(cell)
    find_normal(face, cell)
    length_ = sqrt(nx * nx + nz * nz)
    nx /= length_
    nz /= length_
    out = nx * (face_x[face] - cell_x[cell]) + nz * (face_z[face] - cell_z[cell])
    # snGrad(U) - (n & grad(U)): what the gradient along n lacks on the face
    split(velocity[cell], at, between)
    more_x = -at[2] / out - (nx * g_xx + nz * g_zx)
    more_z = -at[4] / out - (nx * g_xz + nz * g_zz)
    g_xx += nx * more_x
    g_xz += nx * more_z
    g_zx += nz * more_x
    g_zz += nz * more_z
    third = 2 / 3 * (g_xx + g_zz)
    x = nu_eff * ((2 * g_xx - third) * nx + (g_xz + g_zx) * nz)
    z = nu_eff * ((g_xz + g_zx) * nx + (2 * g_zz - third) * nz)
    printf "(%.10g 0 %.10g)\n", x, z
    stress_x[face] = x
    stress_z[face] = z
}

# Write stress and velocity along the faces of the bed.
function write_bed_flow(file,    i, face, along_x, along_z, length_, at, stress, speed) {
    print "tau_m2_s2,u_m_s" >file
    for (i = 0; i < bed_faces; i++) {
        face = start["bed"] + i
        along_x = x2[face] - x1[face]
        along_z = z2[face] - z1[face]
        # downstream; the faces of the bed are never upright
        length_ = sqrt(along_x * along_x + along_z * along_z)
        if (along_x < 0)
            length_ = -length_
        split(velocity[owner[face]], at, between)
        stress = -(stress_x[face] * along_x + stress_z[face] * along_z) / length_
        speed = (at[2] * along_x + at[4] * along_z) / length_
        printf "%.6g,%.6g\n", stress, speed >file
    }
    close(file)
}

# Write the mean velocity in the column before the inlet.
function write_column_flow(file,    i, face, high, height, flux, at) {
    for (i = 0; i < size["before"]; i++) {
        face = start["before"] + i
        measure_face(face)
        high = z2[face] - z1[face]
        if (high < 0)
            high = -high
        split(velocity[owner[face]], at, between)
        height += high
        flux += high * at[2]
    }
    print "mean_velocity_m_s" >file
    printf "%.6g\n", flux / height >file
    close(file)
}

# Print all of the field before the values on the bed, which is the last of its patches.
function print_head(    names, i, calculated) {
    calculated = "        type            calculated;\n"
    print "FoamFile\n{\n    version     2.0;\n    format      ascii;"
    print "    class       volVectorField;\n    location    \"" time "\";"
    print "    object      wallShearStress;\n}\n\ndimensions      [0 2 -2 0 0 0 0];\n"
    print "internalField   uniform (0 0 0);\n\nboundaryField\n{"
    split(patches, names, " ")
    for (i = 1; i in names; i++) {
        if (names[i] == "bed")
            continue
        print "    " names[i] "\n    {"
        if (type[names[i]] == "cyclic" || type[names[i]] == "empty")
            print "        type            " type[names[i]] ";\n    }"
        else
            print calculated "        value           uniform (0 0 0);\n    }"
    }
    print "    bed\n    {\n" calculated "        value           nonuniform List<vector>"
    print bed_faces "\n("
}

function fail(cause) {
    print "wallShearStress.awk: " cause >"/dev/stderr"
    exit 1
}

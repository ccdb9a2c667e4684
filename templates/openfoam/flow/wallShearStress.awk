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
# A face is divided into triangles about the mean of its corners, and a cell into
# pyramids about the mean of the centres of its faces. A mesh with empty sides is one cell
# thick along y, and its flow is in a plane.
#
# Writes besides what a study reads of the flow, with as many digits as the fields of all
# processors share. bed_flow.csv has for each face of the bed:
#
#   in a plane: the stress of the flow on it over the density and the velocity in the cell
#   on it, both along the face and positive downstream, with six digits;
#   in space: the stress of the flow on it along the face over that before the inlet, with
#   four decimals, since thousands of faces share six digits no more, and the friction
#   velocity before the inlet, with six digits.
#
# column_flow.csv has the mean velocity in the cells before the inlet, with six digits.

BEGIN {
    # the items of the lists are lines such as "4(0 1 23 22)" and "(0.1 0 0.2)"
    between = "[ ()]+"
    mesh = "constant/polyMesh/"
    read_patches(mesh "boundary")
    find_cells()
    find_sides()
    read_wanted(mesh "faces", "", face_wanted, corners)
    for (face in corners)
        want_points(corners[face])
    read_wanted(mesh "points", "", point_wanted, points)
    read_wanted(time "/U", "internalField", velocity_wanted, velocity)
    bed_faces = read_all(time "/nut", "bed", nut)
    if (bed_faces != size["bed"])
        fail("the results are not whole: " time "/nut")

    for (face in corners)
        measure_face(face)
    for (cell in measured)
        measure_cell(cell)
    for (patch in touched)
        set_velocity_on(patch)

    print_head()
    for (i = 0; i < bed_faces; i++)
        print_stress(start["bed"] + i, nu + nut[i])
    print ")\n;\n    }\n}\n\n// ************************************************ //"
    if (is_plane)
        write_plane_bed_flow("bed_flow.csv")
    else
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
    close(file)
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
    if (!("bed" in start) || !("before" in start))
        fail(file ": there is no patch named bed, or none named before")
    is_plane = type["sides"] == "empty"
}

# Open the first list of a file, or the first one behind a line that begins with some
# word, of a patch that of its values: a rough wall has a list of lengths, too; the
# number of its items.
function open_list(file, word,    line, words, before) {
    while (words[1] != word && (getline line <file) > 0)
        split(line, words, " ")
    if (word in start)
        while (words[1] != "value" && (getline line <file) > 0)
            split(line, words, " ")
    while (line != "(" && (getline line <file) > 0)
        if (line != "(")
            before = line
    if (line != "(")
        fail("the results are not whole: " file)
    return before + 0
}

# The next item of an open list.
function next_item(file,    line) {
    if ((getline line <file) <= 0 || line == ")")
        fail("the results are not whole: " file)
    return line
}

# Close a list of which all items were read.
function close_list(file,    line) {
    if ((getline line <file) <= 0 || line != ")")
        fail("the results are not whole: " file)
    close(file)
}

# Read all items of a list; their number.
function read_all(file, word, items,    count, i) {
    count = open_list(file, word)
    for (i = 0; i < count; i++)
        items[i] = next_item(file)
    close_list(file)
    return count
}

# Read those items of a list that are wanted: there are millions of others.
function read_wanted(file, word, wanted, items,    count, i, line) {
    count = open_list(file, word)
    for (i = 0; i < count; i++) {
        line = next_item(file)
        if (i in wanted)
            items[i] = line
    }
    close_list(file)
}

# Find the cells whose centres are needed: the cells on the bed, and for the
# interpolation to their sides those beside them.
function find_cells(    file, other, count, i, end, cell, beyond) {
    file = mesh "owner"
    other = mesh "neighbour"
    count = open_list(file, "")
    end = start["bed"] + size["bed"]
    for (i = 0; i < count; i++) {
        cell = next_item(file)
        if (i < start["bed"] || i >= end)
            continue
        on_bed[cell] = 1
        measured[cell] = 1
    }
    close_list(file)

    open_list(file, "")
    inner_faces = open_list(other, "")
    for (i = 0; i < inner_faces; i++) {
        cell = next_item(file)
        beyond = next_item(other)
        if (cell in on_bed)
            measured[beyond] = 1
        if (beyond in on_bed)
            measured[cell] = 1
    }
    close(file)
    close_list(other)
}

# Find the sides of these cells, and the patches that bound cells on the bed.
function find_sides(    file, other, count, i, cell, beyond, names, number, patch) {
    file = mesh "owner"
    other = mesh "neighbour"
    count = open_list(file, "")
    open_list(other, "")
    for (i = 0; i < inner_faces; i++) {
        cell = next_item(file)
        beyond = next_item(other)
        if (cell in measured || beyond in measured) {
            add_side(cell, i)
            add_side(beyond, i)
            owner[i] = cell
            neighbour[i] = beyond
        }
    }
    close_list(other)
    split(patches, names, " ")
    for (; i < count; i++) {
        cell = next_item(file)
        if (is_on(i, "before")) {
            face_wanted[i] = 1
            velocity_wanted[cell] = 1
            owner[i] = cell
        }
        if (!(cell in measured))
            continue
        add_side(cell, i)
        owner[i] = cell
        if (!(cell in on_bed))
            continue
        for (number = 1; number in names; number++) {
            patch = names[number]
            if (is_on(i, patch))
                touched[patch] = 1
        }
    }
    close_list(file)
}

function is_on(face, patch) {
    return face >= start[patch] && face < start[patch] + size[patch]
}

function add_side(cell, face) {
    face_wanted[face] = 1
    if (!(cell in measured))
        return
    velocity_wanted[cell] = 1
    sides[cell] = sides[cell] " " face
}

function want_points(list,    at, i) {
    split(list, at, between)
    for (i = 2; i <= 5; i++)
        point_wanted[at[i]] = 1
}

# Set the velocity on those faces of a patch that bound the cells.
function set_velocity_on(patch,    values, i, face) {
    if (patch == "inlet" || patch == "outlet" || patch == "lid")
        read_all(time "/U", patch, values)
    for (i = 0; i < size[patch]; i++) {
        face = start[patch] + i
        if (!(face in face_wanted))
            continue
        if (type[patch] == "wall")
            velocity_on[face] = "(0 0 0)"
        else if (type[patch] == "cyclic" || type[patch] == "empty")
            # before the inlet is one cell: what leaves it enters it; as in a plane aside
            velocity_on[face] = velocity[owner[face]]
        else if (patch == "sides")
            velocity_on[face] = slipping(face)
        else
            velocity_on[face] = values[i]
    }
}

# The velocity in the cell beside a face without its part through the face.
function slipping(face,    at, through) {
    split(velocity[owner[face]], at, between)
    through = at[2] * area_x[face] + at[3] * area_y[face] + at[4] * area_z[face]
    through /= area_x[face] ^ 2 + area_y[face] ^ 2 + area_z[face] ^ 2
    return "(" at[2] - through * area_x[face] " " at[3] - through * area_y[face] \
        " " at[4] - through * area_z[face] ")"
}

# Find the area vector of a face, from its owner to its neighbour, and its centre.
function measure_face(face,    at, p, i, k, next_, px, py, pz, mx, my, mz,
                      ax, ay, az, bx, by, bz, nx, ny, nz, size_, sum, cx, cy, cz) {
    split(corners[face], at, between)
    for (i = 1; i <= 4; i++) {
        split(points[at[i + 1]], p, between)
        px[i] = p[2]
        py[i] = p[3]
        pz[i] = p[4]
        mx += p[2] / 4
        my += p[3] / 4
        mz += p[4] / 4
    }
    for (i = 1; i <= 4; i++) {
        next_ = i % 4 + 1
        ax = px[next_] - px[i]
        ay = py[next_] - py[i]
        az = pz[next_] - pz[i]
        bx = mx - px[i]
        by = my - py[i]
        bz = mz - pz[i]
        nx = ay * bz - az * by
        ny = az * bx - ax * bz
        nz = ax * by - ay * bx
        size_ = sqrt(nx * nx + ny * ny + nz * nz)
        area_x[face] += nx / 2
        area_y[face] += ny / 2
        area_z[face] += nz / 2
        sum += size_
        cx += size_ * (px[i] + px[next_] + mx) / 3
        cy += size_ * (py[i] + py[next_] + my) / 3
        cz += size_ * (pz[i] + pz[next_] + mz) / 3
    }
    face_x[face] = cx / sum
    face_y[face] = cy / sum
    face_z[face] = cz / sum
}

# Find the volume of a cell and its centre.
function measure_cell(cell,    side, count, i, face, x, y, z, part, cx, cy, cz) {
    count = split(sides[cell], side, " ")
    for (i = 1; i <= count; i++) {
        face = side[i]
        x += face_x[face] / count
        y += face_y[face] / count
        z += face_z[face] / count
    }
    for (i = 1; i <= count; i++) {
        face = side[i]
        part = area_x[face] * (face_x[face] - x) + area_y[face] * (face_y[face] - y)
        part += area_z[face] * (face_z[face] - z)
        if (owner[face] != cell)
            part = -part
        volume[cell] += part / 3
        cx += part / 3 * (0.75 * face_x[face] + 0.25 * x)
        cy += part / 3 * (0.75 * face_y[face] + 0.25 * y)
        cz += part / 3 * (0.75 * face_z[face] + 0.25 * z)
    }
    cell_x[cell] = cx / volume[cell]
    cell_y[cell] = cy / volume[cell]
    cell_z[cell] = cz / volume[cell]
}

# The distance from a cell's centre to that of one of its faces along the face's area
# vector, times the area.
function away(cell, face,    out) {
    out = area_x[face] * (face_x[face] - cell_x[cell])
    out += area_y[face] * (face_y[face] - cell_y[cell])
    out += area_z[face] * (face_z[face] - cell_z[cell])
    return out
}

# Set u, v and w to the velocity on a face: between two cells it is linear.
function find_velocity(face,    at, beyond, to_one, to_other, part) {
    if (face >= inner_faces) {
        split(velocity_on[face], at, between)
        u = at[2]
        v = at[3]
        w = at[4]
        return
    }
    to_one = away(owner[face], face)
    to_other = -away(neighbour[face], face)
    part = to_other / (to_one + to_other)
    split(velocity[owner[face]], at, between)
    split(velocity[neighbour[face]], beyond, between)
    u = part * at[2] + (1 - part) * beyond[2]
    v = part * at[3] + (1 - part) * beyond[3]
    w = part * at[4] + (1 - part) * beyond[4]
}

# Set g_xx to g_zz to the gradient of the velocity in a cell; g_xz is that of w along x.
function find_gradient(cell,    side, count, i, ax, ay, az, sign) {
    g_xx = g_xy = g_xz = g_yx = g_yy = g_yz = g_zx = g_zy = g_zz = 0
    count = split(sides[cell], side, " ")
    for (i = 1; i <= count; i++) {
        find_velocity(side[i])
        sign = owner[side[i]] == cell ? 1 : -1
        ax = sign * area_x[side[i]] / volume[cell]
        ay = sign * area_y[side[i]] / volume[cell]
        az = sign * area_z[side[i]] / volume[cell]
        g_xx += ax * u
        g_xy += ax * v
        g_xz += ax * w
        g_yx += ay * u
        g_yy += ay * v
        g_yz += ay * w
        g_zx += az * u
        g_zy += az * v
        g_zz += az * w
    }
}

# Print the stress of a face of the bed, where the effective viscosity is nu_eff.
function print_stress(face, nu_eff,
                      cell, size_, nx, ny, nz, at, out, more_x, more_y, more_z, third,
                      x, y, z, through) {
    cell = owner[face]
    find_gradient(cell)
    size_ = sqrt(area_x[face] ^ 2 + area_y[face] ^ 2 + area_z[face] ^ 2)
    nx = area_x[face] / size_
    ny = area_y[face] / size_
    nz = area_z[face] / size_
    out = away(cell, face) / size_
    # snGrad(U) - (n & grad(U)): what the gradient along n lacks on the face
    split(velocity[cell], at, between)
    more_x = -at[2] / out - (nx * g_xx + ny * g_yx + nz * g_zx)
    more_y = -at[3] / out - (nx * g_xy + ny * g_yy + nz * g_zy)
    more_z = -at[4] / out - (nx * g_xz + ny * g_yz + nz * g_zz)
    g_xx += nx * more_x
    g_xy += nx * more_y
    g_xz += nx * more_z
    g_yx += ny * more_x
    g_yy += ny * more_y
    g_yz += ny * more_z
    g_zx += nz * more_x
    g_zy += nz * more_y
    g_zz += nz * more_z
    third = 2 / 3 * (g_xx + g_yy + g_zz)
    x = (2 * g_xx - third) * nx + (g_xy + g_yx) * ny + (g_xz + g_zx) * nz
    y = (g_xy + g_yx) * nx + (2 * g_yy - third) * ny + (g_yz + g_zy) * nz
    z = (g_xz + g_zx) * nx + (g_yz + g_zy) * ny + (2 * g_zz - third) * nz
    x *= nu_eff
    y *= is_plane ? 0 : nu_eff  # without round-off
    z *= nu_eff
    printf "(%.10g %.10g %.10g)\n", x, y, z
    through = x * nx + y * ny + z * nz
    stress_x[face] = through * nx - x
    stress_y[face] = through * ny - y
    stress_z[face] = through * nz - z
}

# Write stress and velocity along the faces of a bed in a plane.
function write_plane_bed_flow(file,    i, face, along_x, along_z, size_, at) {
    print "tau_m2_s2,u_m_s" >file
    for (i = 0; i < bed_faces; i++) {
        face = start["bed"] + i
        # downstream; the area vector points out of the flow, downwards
        size_ = sqrt(area_x[face] ^ 2 + area_z[face] ^ 2)
        along_x = -area_z[face] / size_
        along_z = area_x[face] / size_
        split(velocity[owner[face]], at, between)
        printf "%.6g,%.6g\n", stress_x[face] * along_x + stress_z[face] * along_z,
            at[2] * along_x + at[4] * along_z >file
    }
    close(file)
}

# Write the stress along the faces of the bed over that before the inlet.
function write_bed_flow(file,    i, face, count, in_slab, upstream) {
    for (i = 0; i < size["before"]; i++)
        in_slab[owner[start["before"] + i]] = 1
    for (i = 0; i < bed_faces; i++) {
        face = start["bed"] + i
        if (!(owner[face] in in_slab))
            continue
        upstream += stress_x[face]
        count++
    }
    upstream /= count
    if (upstream <= 0)
        fail("no flow before the inlet")
    print "ustar0_m_s,tau_x,tau_y,tau_z" >file
    for (i = 0; i < bed_faces; i++) {
        face = start["bed"] + i
        printf "%.6g,%s,%s,%s\n", sqrt(upstream), decimals(stress_x[face] / upstream),
            decimals(stress_y[face] / upstream), decimals(stress_z[face] / upstream) >file
    }
    close(file)
}

# Write the mean velocity in the cells before the inlet.
function write_column_flow(file,    i, face, through, flux, at) {
    for (i = 0; i < size["before"]; i++) {
        face = start["before"] + i
        split(velocity[owner[face]], at, between)
        through -= area_x[face]
        flux -= area_x[face] * at[2]
    }
    print "mean_velocity_m_s" >file
    printf "%.6g\n", flux / through >file
    close(file)
}

# A number with four decimals; there is no negative zero.
function decimals(value,    text) {
    text = sprintf("%.4f", value)
    return text == "-0.0000" ? "0.0000" : text
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

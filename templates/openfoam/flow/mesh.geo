// A bed line under a flow: a block of hexahedra from each of its corners to the next one,
// with vertical grid lines, one cell thick. x downstream, z upwards from the flat bed.
Include "parameters.geo";
Include "bed_line.geo";

Mesh.MshFileVersion = 2.2;  // gmshToFoam reads it
Mesh.Binary = 0;

thickness = height/10;
// below it cells grow by `growth`, above it by `growth_far`
near = 4*height;
If (near > lid/2 || closed)
  near = lid/2;
EndIf

// one column of cells ahead of the inlet, with the same rows: the flow that enters develops in it
start = bed_line(0);
line() = {start - 1.5*height, bed_line(1), 1, 1, start - 0.5*height, bed_line(1), 0, 1, bed_line()};

// the grid lines are vertical, the height of the first cell is normal to the windward faces
first_up = first_cell/Cos(slope_deg*Pi/180);
cells_near = Ceil(Log(1 + near*(growth - 1)/first_up)/Log(growth));
first_far = first_up*growth^cells_near;
cells_far = Ceil(Log(1 + (lid - near)*(growth_far - 1)/first_far)/Log(growth_far));
If (closed)
  cells_far = cells_near;
EndIf

// the ratio at which `cells` cells, beginning with `first`, fill `length` exactly
Macro Ratio
  low = 1e-2;
  high = 4;
  For bisection In {1:60}
    ratio = (low + high)/2;
    If (first*(ratio^cells - 1)/(ratio - 1) < length)
      low = ratio;
    Else
      high = ratio;
    EndIf
  EndFor
Return

// every entity by its number: to let gmsh find them, as Extrude does, takes minutes for 1000 corners.
// Points of corner i: on the bed and on the lid, here and, beyond the cells, there; then those
// between the near and the far rows.
n = #line()/4;
last = n - 1;
level = 1e300;
For i In {0:last}
  x = line(4*i);
  If (line(4*i + 1) != level)
    level = line(4*i + 1);
    first = first_up;
    cells = cells_near;
    length = near - level;
    Call Ratio;
    ratio_near = ratio;
    first = first_up*ratio_near^cells_near;
    If (closed)  // the rows at the lid are those of the bed, from above
      first = first_up;
    EndIf
    cells = cells_far;
    length = lid - near;
    Call Ratio;
    ratio_far = ratio;
    If (closed)
      ratio_far = 1/ratio;
    EndIf
  EndIf
  Point(1 + i) = {x, 0, level};
  Point(1 + n + i) = {x, 0, lid};
  Point(1 + 2*n + i) = {x, thickness, level};
  Point(1 + 3*n + i) = {x, thickness, lid};
  For side In {0:1}  // here and there
    Point(1 + (4 + side)*n + i) = {x, side*thickness, near};
    Line(1 + side*n + i) = {1 + 2*side*n + i, 1 + (4 + side)*n + i};
    Line(1 + (8 + side)*n + i) = {1 + (4 + side)*n + i, 1 + (1 + 2*side)*n + i};
  EndFor
  Line(1 + 2*n + i) = {1 + i, 1 + 2*n + i};
  Line(1 + 3*n + i) = {1 + n + i, 1 + 3*n + i};
  Transfinite Curve{1 + i, 1 + n + i} = cells_near + 1 Using Progression ratio_near;
  Transfinite Curve{1 + 8*n + i, 1 + 9*n + i} = cells_far + 1 Using Progression ratio_far;
  Transfinite Curve{1 + 2*n + i, 1 + 3*n + i} = 2;
  Curve Loop(1 + i) = {1 + i, 1 + 8*n + i, 1 + 3*n + i, -(1 + 9*n + i), -(1 + n + i),
    -(1 + 2*n + i)};
  Plane Surface(1 + i) = {1 + i};
  Transfinite Surface{1 + i} = {1 + i, 1 + n + i, 1 + 3*n + i, 1 + 2*n + i};
EndFor
For i In {0:last - 1}
  If (i != 1)  // there are no cells between the column and the inlet
    For side In {0:3}
      Line(1 + (4 + side)*n + i) = {1 + side*n + i, 2 + side*n + i};
      Transfinite Curve{1 + (4 + side)*n + i} = line(4*i + 2) + 1
        Using Progression line(4*i + 3);
    EndFor
    For side In {0:1}  // here and there
      Curve Loop(1 + (1 + side)*n + i) = {1 + (4 + 2*side)*n + i, 2 + side*n + i,
        2 + (8 + side)*n + i, -(1 + (5 + 2*side)*n + i), -(1 + (8 + side)*n + i),
        -(1 + side*n + i)};
      // bed and lid
      Curve Loop(1 + (3 + side)*n + i) = {1 + (4 + side)*n + i, 2 + (2 + side)*n + i,
        -(1 + (6 + side)*n + i), -(1 + (2 + side)*n + i)};
    EndFor
    For side In {1:4}
      Plane Surface(1 + side*n + i) = {1 + side*n + i};
    EndFor
    For side In {0:1}
      Transfinite Surface{1 + (1 + side)*n + i} = {1 + 2*side*n + i, 2 + 2*side*n + i,
        2 + (1 + 2*side)*n + i, 1 + (1 + 2*side)*n + i};
      Transfinite Surface{1 + (3 + side)*n + i};
    EndFor
    Surface Loop(1 + i) = {1 + i, 2 + i, 1 + n + i, 1 + 2*n + i, 1 + 3*n + i, 1 + 4*n + i};
    Volume(1 + i) = {1 + i};
    Transfinite Volume{1 + i} = {1 + i, 2 + i, 2 + 2*n + i, 1 + 2*n + i, 1 + n + i, 2 + n + i,
      2 + 3*n + i, 1 + 3*n + i};
  EndIf
EndFor
Recombine Surface{:};

Physical Volume("approach") = {1};
Physical Volume("air") = {3:last};
Physical Surface("bed") = {1 + 3*n, 3 + 3*n:3*n + last};
Physical Surface("lid") = {1 + 4*n, 3 + 4*n:4*n + last};
Physical Surface("before") = {1};
Physical Surface("after") = {2};
Physical Surface("inlet") = {3};
Physical Surface("outlet") = {n};
Physical Surface("sides") = {1 + n, 3 + n:n + last, 1 + 2*n, 3 + 2*n:2*n + last};

// A bed line under a boundary layer: a block of hexahedra from each of its corners to the next one,
// with vertical grid lines, one cell thick. x downstream, z upwards from the flat bed.
Include "parameters.geo";
Include "bed_line.geo";

Mesh.MshFileVersion = 2.2;  // gmshToFoam reads it
Mesh.Binary = 0;

lid = 10*height;
thickness = height/10;

// the grid lines are vertical, the height of the first cell is normal to the windward faces
first = first_cell/Cos(slope_deg*Pi/180);
cells_up = Ceil(Log(1 + lid*(growth - 1)/first)/Log(growth));

// the ratio at which these cells, beginning with `first`, fill `length` exactly
Macro Ratio
  low = 1 + 1e-9;
  high = 2;
  For bisection In {1:60}
    ratio = (low + high)/2;
    If (first*(ratio^cells_up - 1)/(ratio - 1) < length)
      low = ratio;
    Else
      high = ratio;
    EndIf
  EndFor
Return

// every entity by its number: to let gmsh find them, as Extrude does, takes minutes for 1000 corners.
// Points of corner i: on the bed and on the lid, here and, beyond the cells, there.
n = #bed_line()/4;
last = n - 1;
level = 1e300;
For i In {0:last}
  x = bed_line(4*i);
  If (bed_line(4*i + 1) != level)
    level = bed_line(4*i + 1);
    length = lid - level;
    Call Ratio;
  EndIf
  Point(1 + i) = {x, 0, level};
  Point(1 + n + i) = {x, 0, lid};
  Point(1 + 2*n + i) = {x, thickness, level};
  Point(1 + 3*n + i) = {x, thickness, lid};
  Line(1 + i) = {1 + i, 1 + n + i};
  Line(1 + n + i) = {1 + 2*n + i, 1 + 3*n + i};
  Line(1 + 2*n + i) = {1 + i, 1 + 2*n + i};
  Line(1 + 3*n + i) = {1 + n + i, 1 + 3*n + i};
  Transfinite Curve{1 + i, 1 + n + i} = cells_up + 1 Using Progression ratio;
  Transfinite Curve{1 + 2*n + i, 1 + 3*n + i} = 2;
  Curve Loop(1 + i) = {1 + i, 1 + 3*n + i, -(1 + n + i), -(1 + 2*n + i)};
  Plane Surface(1 + i) = {1 + i};
EndFor
For i In {0:last - 1}
  For side In {0:3}
    Line(1 + (4 + side)*n + i) = {1 + side*n + i, 2 + side*n + i};
    Transfinite Curve{1 + (4 + side)*n + i} = bed_line(4*i + 2) + 1
      Using Progression bed_line(4*i + 3);
  EndFor
  For side In {0:1}  // here and there
    Curve Loop(1 + (1 + side)*n + i) = {1 + (4 + 2*side)*n + i, 2 + side*n + i,
      -(1 + (5 + 2*side)*n + i), -(1 + side*n + i)};
    // bed and lid
    Curve Loop(1 + (3 + side)*n + i) = {1 + (4 + side)*n + i, 2 + (2 + side)*n + i,
      -(1 + (6 + side)*n + i), -(1 + (2 + side)*n + i)};
  EndFor
  For side In {1:4}
    Plane Surface(1 + side*n + i) = {1 + side*n + i};
  EndFor
  Surface Loop(1 + i) = {1 + i, 2 + i, 1 + n + i, 1 + 2*n + i, 1 + 3*n + i, 1 + 4*n + i};
  Volume(1 + i) = {1 + i};
EndFor
Transfinite Surface{:};
Recombine Surface{:};
Transfinite Volume{:};

Physical Volume("air") = {1:last};
Physical Surface("bed") = {1 + 3*n:3*n + last};
Physical Surface("lid") = {1 + 4*n:4*n + last};
Physical Surface("inlet") = {1};
Physical Surface("outlet") = {n};
Physical Surface("sides") = {1 + n:n + last, 1 + 2*n:2*n + last};

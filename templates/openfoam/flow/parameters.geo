// The mesh over bed_line.geo; after a change see README.md. SI units.
slope_deg = 15.0;        // of the windward faces; 0 if there are none, degrees
height = 0.02;           // of the forms, m
lid = 2.0;               // height of the lid above the flat bed; lidHeight of parameters, m
closed = 0;              // 1 where the top is a wall
first_cell = 0.0005;     // height of the cells on the bed, normal to the windward faces, m
growth = 1.21;           // ratio of neighbouring cells up to 4 heights; 1.1 for a study
growth_far = 1.69;       // and above; 1.3 for a study

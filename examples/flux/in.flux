# A level bed of grains that feeds itself, under a flow that is held at one speed after another.
#
#   liggghts -in in.flux
#
# One plane of grains, periodic along the flow, on a row of fixed ones: what leaves on the right enters
# on the left. Grain types: 1 fixed, 2 mobile. The flow acts on each grain by the speed at its height
# over its own: drag of Schiller and Naumann, Saffman's lift on what lies over `level`, on the log law
# above that. flows.txt lists the friction velocities, m/s. With hold = 0 the bed settles, in a thick
# fluid, and settled.dump tells where it lies. Writes flux.csv: a line for each flow with the sum of the
# grains' displacements, m, in the second half of the hold, and its time, s.

include         parameters.liggghts
units           si
atom_style      granular
atom_modify     map array sort 0 0
dimension       3
boundary        p f f
newton          off
communicate     single vel yes
read_data       grains.data
group           fixed type 1
group           mobile type 2
include         contact.liggghts
fix             frozen fixed freeze
fix             weight mobile gravity ${gravity} vector 0 0 -1
fix             motion mobile nve/sphere
variable        skin equal 0.3*${diameter}
variable        bins equal 3*${diameter}
neighbor        ${skin} bin
neigh_modify    delay 0 every 1 check yes binsize ${bins} exclude type 1 1

variable        unit equal sqrt(${diameter}/${gravity})
variable        dt equal ${time_step}*sqrt(${mass}*${smallest}^3/${spring})
timestep        ${dt}
compute         size mobile property/atom radius
compute         way mobile property/atom xu
compute         travelled mobile reduce sum c_way
variable        travelled equal c_travelled
thermo_style    custom step atoms ke c_travelled
thermo          1000000
thermo_modify   lost ignore norm no

if "${hold} > 0" then "jump SELF flow"
variable        thick equal 0.3*${mass}/${unit}
variable        steps equal floor(80*${unit}/${dt})
fix             thick mobile viscous ${thick}
run             ${steps} post no
dump            bed all custom 1 settled.dump id type x z radius
dump_modify     bed sort id format "%d %d %.17g %.17g %.17g"
run             0 post no
jump            SELF done

label           flow
variable        half equal floor(0.5*${hold}*${unit}/${dt})
variable        time equal ${half}*${dt}
variable        over atom (z-${level}>${roughness})*(z-${level}-${roughness})+${roughness}
print           "ustar_m_s,moved_m,time_s" file flux.csv
variable        ustar file flows.txt
label           hold
variable        shear equal 2.5*${ustar}
variable        behind atom ${shear}*ln(v_over/${roughness})-vx
variable        reynolds atom sqrt(v_behind^2+vz^2)*2*c_size/${viscosity}
variable        grip atom 6*PI*${fluid}*${viscosity}*c_size*(1+0.15*v_reynolds^0.687)
variable        lift atom (z>${level}+${roughness})*4*${saffman}*${fluid}*c_size^2*sqrt(${viscosity}*${shear}/v_over)*v_behind
variable        fx atom v_grip*v_behind
variable        fz atom v_lift-v_grip*vz
fix             flow mobile addforce v_fx 0.0 v_fz
run             ${half} post no
variable        before equal ${travelled}
run             ${half} post no
variable        moved equal ${travelled}-${before}
print           "${ustar},${moved},${time}" append flux.csv screen no
unfix           flow
next            ustar
jump            SELF hold
label           done
print           "the protocol has ended"

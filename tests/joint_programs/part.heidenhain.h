0 BEGIN PGM PART MM
1 ; part.ngc on linear_delta, mode +++, joints, made by parakin
2 ; X is tower_a in mm, Y is tower_b in mm, Z is tower_c in mm
3 ; 0.339 s from the first record on, 4.0 s to it
4 ; F is mm or degrees a minute
5 ; no tilted working plane, no M128, no TCPM
6 ; turning axes count on beyond 360 deg, by M127
7 ; part zero at X 0 Y 0 Z 0 in the machine
8 ; the tool: 80 mm from the spindle's nose to its tip, the machine's own length
9 TOOL CALL Z S9000
10 M3
11 L X+997.1028 Y+997.1028 Z+997.1028 R0 F15000.000 M91
12 M8
13 L X+997.0832 Y+995.1091 Z+999.0512 R0 F1484.004 M91
14 ; half way
15 CYCL DEF 9.0 DWELL TIME
16 CYCL DEF 9.1 DWELL 0.5
17 L X+999.3356 Y+993.9468 Z+997.8961 R0 F1472.719 M91
18 M9
19 M0
20 L X+999.3551 Y+995.9442 Z+995.9442 R0 F1486.508 M91
21 M5
22 M30
23 END PGM PART MM

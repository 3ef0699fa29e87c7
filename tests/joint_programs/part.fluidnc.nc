( part.ngc on linear_delta, mode +++, joints, made by parakin )
( X is tower_a in mm, Y is tower_b in mm, Z is tower_c in mm )
( 0.339 s from the first record on, 4.0 s to it )
( F is the inverse of minutes )
( max_rate_mm_per_min and acceleration_mm_per_sec2: speeds and accelerations of the joints, mm or degrees )
( M7 and M8 act only where coolant is configured, M4 only where the spindle can be reversed )
( part zero at X 0 Y 0 Z 0 in the machine )
( the tool: 80 mm from the spindle's nose to its tip, the machine's own length )
G21G90G17G40G49
G94
S9000
M3
G93
G53G1X997.1028Y997.1028Z997.1028F15.000
M8
G53G1X997.0832Y995.1091Z999.0512F532.332
(MSG,half way)
G4P0.5
G53G1X999.3356Y993.9468Z997.8961F528.726
M9
M0
G53G1X999.3551Y995.9442Z995.9442F532.258
M5
M2

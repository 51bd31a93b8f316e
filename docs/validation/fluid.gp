# Pictures of fluid.md:  gnuplot -e "runs='build/validation'" docs/validation/fluid.gp, after validate --heavy. Arrays: the table of fluid.md, kept here.
if (!exists("runs")) runs = "build/validation"
set datafile separator ","
set terminal pngcairo size 900,620 font "DejaVu Sans,11"
set grid lc rgb "#dddddd"

set output "docs/validation/ten-cate.png"
set xlabel "time [s]"; set ylabel "velocity [m/s]"; set key at 4,-0.088 top right
set xrange [0:4]; set yrange [-0.135:0]
set title "Sphere settling in four oils: computed, and measured by ten Cate et al. 2002 (dotted: greatest speeds)"
do for [i=1:4] { v = word("-0.1226 -0.0869 -0.0571 -0.0363", i) + 0; set arrow i from 0,v to 4,v nohead dt 3 lc rgb "#999999" }
d = runs."/ten-cate-"
plot d."E4-54.csv" u 1:3 every ::1 w l lw 2 lc rgb "#c0392b" t "E4, Re 32, 16 cells per diameter", d."E4-27.csv" u 1:3 every ::1 w l dt 2 lc rgb "#c0392b" t "E4, 8 cells", \
 "pipeline/validation/reference/ten-cate-e4.csv" u 1:2 every ::1 w p pt 6 lc rgb "#000000" t "E4 measured", \
 d."E3-54.csv" u 1:3 every ::1 w l lw 2 lc rgb "#2980b9" t "E3, Re 12, 16 cells", d."E2-54.csv" u 1:3 every ::1 w l lw 2 lc rgb "#27ae60" t "E2, Re 4.1, 16 cells", \
 d."E1-27.csv" u 1:3 every ::1 w l lw 2 lc rgb "#8e44ad" t "E1, Re 1.5, 8 cells"

unset arrow; set datafile separator whitespace
$array << EOD
# solid fraction, K of Zick & Homsy, K at 7, 10, 14, 20 cells per diameter, error in % at each; then with the paper's corner rule and C1 = 20
0.027 2.008 2.0398 2.0269 2.0239 2.0155 +1.59 +0.94 +0.79 +0.37 -1.67 -0.19 0.54 0.47
0.064 2.81 2.9098 2.8375 2.8307 2.8228 +3.55 +0.98 +0.74 +0.46 -1.08 -0.68 0.28 0.54
0.125 4.292 4.2669 4.3109 4.3172 4.3104 -0.58 +0.44 +0.59 +0.43 -5.49 -1.92 0.14 0.50
0.216 7.442 7.3634 7.5361 7.5001 7.4486 -1.06 +1.26 +0.78 +0.09 -6.86 -2.42 0.13 0.34
0.343 15.4 15.275 15.191 15.288 15.428 -0.81 -1.36 -0.72 +0.18 -11.15 -5.78 -1.78 0.42
0.45 28.1 27.664 27.891 27.871 28.084 -1.55 -0.74 -0.82 -0.06 -13.30 -5.13 -1.72 0.38
EOD
set output "docs/validation/array-drag.png"
set multiplot layout 1,2
set title "Drag of simple cubic arrays"; set xlabel "solid fraction"; set ylabel "K"; set xrange [0:0.5]; set yrange [1.5:40]; set logscale y; set key default; set key top left
plot $array u 1:2 w lp pt 6 ps 1.5 lc rgb "#000000" t "Zick and Homsy 1982", "" u 1:4 w p pt 2 lc rgb "#c0392b" t "10 cells per diameter", "" u 1:6 w p pt 1 lc rgb "#2980b9" t "20 cells"
unset logscale y; set title "Error at 10 cells per diameter"; set ylabel "error of K [%]"; set yrange [-7:3]; set key default; set key at graph 0.97,0.1 samplen 1
set arrow 1 from 0,1.5 to 0.5,1.5 nohead dt 3; set arrow 2 from 0,-1.5 to 0.5,-1.5 nohead dt 3
plot $array u 1:8 w lp pt 7 lc rgb "#c0392b" t "solid fraction with curvature, C1 = 15", "" u 1:12 w lp pt 5 lc rgb "#888888" t "the paper's corners, C1 = 20"
unset multiplot

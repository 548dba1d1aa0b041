#!/usr/bin/env python3
"""The reliability diagram of the estimator: how often its error is within what the covariance claims.

    python3 assets/measured/reliability.py assets/measured/estimator_reliability.csv assets/pictures/reliability.png

Drawn by gnuplot from the rows of the result file.
"""
import csv
import pathlib
import subprocess
import sys


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    lines = pathlib.Path(sys.argv[1]).read_text().splitlines()
    names, *rows = csv.reader(line for line in lines if not line.startswith('#'))
    plot = ["set terminal pngcairo size 560,520 font 'DejaVu Sans,11'", f"set output '{sys.argv[2]}'",
            f"set xlabel '{names[0]}'", "set ylabel 'found within it, %'", 'set xrange [0:100]', 'set yrange [0:100]',
            'set key bottom right', 'set size square', 'set grid']
    plot.append('$rows << E\n' + '\n'.join(' '.join(row) for row in rows) + '\nE')
    curves = [f"$rows using 1:{i + 2} with linespoints lw 2 pt 7 title '{name}'" for i, name in enumerate(names[1:])]
    plot.append('plot ' + ', '.join(["x with lines dt 2 lc 'black' title 'as claimed'", *curves]))
    subprocess.run(['gnuplot'], input='\n'.join(plot) + '\n', text=True, check=True)


if __name__ == '__main__':
    main()

//! File syntax of ftheta: SVG drawings, machine and recipe files, plan files.

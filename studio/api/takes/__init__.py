"""Routes of takes: lists, solves, exports, references, comparisons, rigs."""

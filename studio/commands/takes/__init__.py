"""Commands of takes: making, calibrating, solving, editing, measuring, drawing and exporting them."""

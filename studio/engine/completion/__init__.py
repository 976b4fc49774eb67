"""Completion (step 8): what the cameras' joints do not say. `relax` (pose), `look_at` (head), `hands`
(fingers), `floor` (feet)."""

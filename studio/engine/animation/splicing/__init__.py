"""Poses that are put together in time: takes spliced, ranges looped, parts that go faster or slower."""

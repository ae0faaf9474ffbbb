"""As many cases are on their way as keep all processors busy."""

from reports.run.workload import AT_LEAST, PIXELS, has_room


def test_small_cases_start_until_their_pixels_are_many():
    small = 80 * 64
    running = []
    while has_room(running):
        running.append(small)

    assert PIXELS <= sum(running) < PIXELS + small


def test_a_few_large_ones_start_all_the_same():
    assert has_room([PIXELS] * (AT_LEAST - 1))
    assert not has_room([PIXELS] * AT_LEAST)

"""Several runs that open one new store at the same moment."""

from concurrent.futures import ThreadPoolExecutor

from feasibility.studies import Store


def opened(path):
    with Store(path) as store:
        return store.find(["k"])


def test_many_open_a_new_file_at_the_same_moment(tmp_path):
    with ThreadPoolExecutor(4) as pool:
        for number in range(60):
            paths = [tmp_path / f"{number}.study"] * 4
            assert list(pool.map(opened, paths)) == [{}] * 4

"""Test the simulation of values from the command line."""

import numpy as np

from ccwsim.cli.program import main


def test_values_are_simulated_and_written(tmp_path, capsys):
    noise = np.random.default_rng(0).random((60, 70))
    field = np.add.outer(np.sin(np.arange(60) / 5), np.cos(np.arange(70) / 7)) + noise
    np.save(tmp_path / "ti.npy", field)
    (tmp_path / "data.csv").write_text("x,y,porosity\n10.5,20.5,0.123456789\n")
    np.savez(tmp_path / "ti.npz", porosity=field)
    outputs = [tmp_path / "out.npz", tmp_path / "out.npy"]
    sizes = ["--template", "16", "--overlap", "4", "--level", "1", "--grid", "50x40"]
    line = ["simulate", str(tmp_path / "ti.npz"), "--continuous", "--variable", "porosity", "--up"]
    line += ["--hard-data", str(tmp_path / "data.csv"), *sizes, "--realizations", "2"]
    refused = str(tmp_path / "out.png")
    assert main([*line, "-o", refused]) == 2
    assert "png contains facies only" in capsys.readouterr().err
    for output in outputs:
        line += ["-o", str(output)]
    assert main(line) == 0
    with np.load(outputs[0]) as saved:
        values = saved["values"]
        assert str(saved["variable"]) == "porosity"
    assert (values[:, 20, 10] == 0.123456789).all()
    assert np.array_equal(np.load(outputs[1]), values)
    assert "porosity (training image): mean" in capsys.readouterr().err

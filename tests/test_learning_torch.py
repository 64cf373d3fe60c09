"""The function for PyTorch: its own checks of gradients, batches, types, and what is not valid."""

import copy
from pathlib import Path

import numpy as np
import pytest
from support.fences import blocks

torch = pytest.importorskip(
    "torch",
    reason="PyTorch is not installed: make torch installs it (gigabytes where pip has CUDA)",
)

import copsense  # noqa: E402
from copsense.errors import InvalidInputError, UnreachablePostureError  # noqa: E402
from copsense.torch import CopFunction  # noqa: E402

NAMES = ("com_x", "com_y", "com_z", "torso_yaw")
LOWER = (0.003, 0.01, -0.02, 0.05)


@pytest.fixture(scope="module")
def f(icub):
    return CopFunction(icub, copsense.minimum_torque(), NAMES)


@pytest.fixture(scope="module")
def masked(icub):
    return CopFunction(icub, copsense.minimum_torque(), NAMES, invalid="mask")


def inputs(f, *batch, dtype=torch.float64):
    draw = np.random.default_rng(0).uniform(-0.005, 0.005, (*batch, len(NAMES)))
    return (f.start + torch.tensor(LOWER) + torch.from_numpy(draw)).to(dtype)


def test_gradients_pass_pytorchs_own_check(f, icub):
    x = inputs(f, 2, 2).requires_grad_()
    assert torch.autograd.gradcheck(f, x, atol=1e-6, rtol=1e-5)
    assert torch.autograd.gradcheck(lambda at: f.values(at)[:3], x, atol=1e-6, rtol=1e-5)
    whole = CopFunction(icub, copsense.minimum_torque())
    chart = copsense.batch.PostureChart(icub, NAMES)
    q = torch.from_numpy(chart.solve(x.detach().numpy()[0]).configurations[:1]).requires_grad_()
    assert torch.autograd.gradcheck(whole, q, atol=1e-6, rtol=1e-5)


def test_batches_of_any_shape_and_vmap_agree(f):
    x = inputs(f, 3)
    rows = f(x)
    assert rows.shape == (3, 2, 2)
    torch.testing.assert_close(f(x.reshape(3, 1, 4)), rows.reshape(3, 1, 2, 2), rtol=0, atol=0)
    torch.testing.assert_close(f(x[1]), rows[1], rtol=0, atol=0)
    torch.testing.assert_close(torch.vmap(f)(x), rows, rtol=0, atol=0)
    each = torch.vmap(torch.func.jacrev(f))(x)
    whole = torch.autograd.functional.jacobian(lambda at: f(at).sum(0), x).permute(2, 0, 1, 3)
    torch.testing.assert_close(each, whole, rtol=0, atol=1e-15)
    assert each.abs().max() > 0.3
    least = lambda at: f.values(at).travel.amin(-1)  # noqa: E731
    x.requires_grad_()
    least(x).sum().backward()
    each = torch.vmap(torch.func.grad(least))(x.detach())
    torch.testing.assert_close(each, x.grad, rtol=0, atol=1e-15)


def test_single_precision_comes_back_as_it_was_given(f):
    x = inputs(f, 2, dtype=torch.float32).requires_grad_()
    values = f.values(x)
    assert (values.cop.dtype, values.travel.dtype) == (torch.float32, torch.float32)
    assert values.valid.dtype == torch.bool
    (values.margin.sum() + values.travel.sum()).backward()
    y = x.detach().double().requires_grad_()
    values = f.values(y)
    (values.margin.sum() + values.travel.sum()).backward()
    torch.testing.assert_close(x.grad, y.grad.float(), rtol=1e-6, atol=1e-7)


def test_what_is_not_valid_is_masked_and_has_no_gradient(f, masked):
    x = inputs(f, 3)
    x[1, 2] = 9.0
    with pytest.raises(UnreachablePostureError, match=r"row 1: .*unreachable"):
        f(x)
    x.requires_grad_()
    values = masked.values(x)
    assert values.valid.tolist() == [True, False, True]
    assert values.cop[1].isnan().all()
    # Even what comes back as NaN stops here.
    torch.where(values.valid, values.travel.amin(-1).sqrt(), -1.0).sum().backward()
    assert not x.grad[1].any()
    assert x.grad[[0, 2]].abs().min() > 1e-5
    x.grad = None
    masked(x).sum().backward()
    assert x.grad.isfinite().all()


def test_second_derivatives_are_an_error(f):
    x = inputs(f, 2).requires_grad_()
    for of in (f, lambda at: f.values(at).travel):
        (slope,) = torch.autograd.grad(of(x).sum(), x, create_graph=True)
        with pytest.raises(InvalidInputError, match="first derivatives only"):
            slope.sum().backward()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda x: x.int(), "is of torch.int32"),
        (lambda x: x[:, :3], r"shape \(2, 3\), but its last axis must hold 4 entries: com_x"),
        (lambda x: x.to("meta"), "is on meta, but the compiled batch runs on the processor"),
    ],
)
def test_another_type_shape_or_device_is_an_error(f, change, words):
    with pytest.raises(InvalidInputError, match=words):
        f(change(inputs(f, 2)))


def test_it_is_a_layer(f):
    torch.manual_seed(0)
    last = torch.nn.Linear(3, 4, dtype=torch.float64)
    torch.nn.init.uniform_(last.weight, -1e-3, 1e-3)
    with torch.no_grad():
        last.bias.copy_(inputs(f))
    net = torch.nn.Sequential(last, f)
    net(torch.ones(5, 3, dtype=torch.float64)).square().sum().backward()
    assert last.weight.grad.abs().max() > 0
    assert "over com_x, com_y, com_z, torso_yaw" in repr(net)
    other = copy.deepcopy(net)  # as for a target network
    torch.testing.assert_close(other(torch.ones(1, 3).double()), net(torch.ones(1, 3).double()))


def test_the_documentations_snippet_runs():
    (snippet,) = blocks(Path(__file__).parents[1] / "docs/learning.md", "py")
    exec(compile(snippet, "docs/learning.md", "exec"), {"__name__": "snippet"})

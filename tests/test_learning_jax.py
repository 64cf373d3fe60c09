"""The function for JAX: its own checks of gradients, jit and vmap, and what is not valid."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

import copsense
from copsense.errors import InvalidInputError, UnreachablePostureError
from copsense.jax import CopFunction

NAMES = ("com_x", "com_y", "com_z", "torso_yaw")
LOWER = np.array([0.003, 0.01, -0.02, 0.05])


@pytest.fixture(scope="module", autouse=True)
def doubles():
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    yield
    jax.config.update("jax_enable_x64", before)


@pytest.fixture(scope="module")
def f(icub):
    return CopFunction(icub, copsense.minimum_torque(), NAMES)


def inputs(f, *batch):
    draw = np.random.default_rng(0).uniform(-0.005, 0.005, (*batch, len(NAMES)))
    return jnp.asarray(f.map.start + LOWER + draw)


def test_gradients_pass_jaxs_own_check(f, icub):
    x = inputs(f, 2)
    check_grads(f, (x,), order=1, modes=["rev"])
    check_grads(lambda at: f.values(at)[:3], (x,), order=1, modes=["rev"])
    check_grads(jax.jit(f), (x,), order=1, modes=["rev"])
    whole = CopFunction(icub, copsense.minimum_torque())
    q = copsense.batch.PostureChart(icub, NAMES).solve(np.array(x[:1])).configurations
    check_grads(whole, (jnp.asarray(q),), order=1, modes=["rev"])


def test_jit_and_vmap_change_nothing(f):
    x = inputs(f, 3)
    rows = f(x)
    assert rows.shape == (3, 2, 2)
    for same in (jax.jit(f)(x), jax.vmap(f)(x), jax.jit(jax.vmap(f))(x), f(x[:, None])[:, 0]):
        np.testing.assert_array_equal(same, rows)

    def least(at):
        return f.values(at).travel.min()

    each = jax.jit(jax.vmap(jax.grad(least)))(x)
    whole = jax.grad(lambda at: f.values(at).travel.min(-1).sum())(x)
    np.testing.assert_allclose(each, whole, rtol=0, atol=1e-15)
    assert np.abs(each).max() > 0.3


def test_single_precision_comes_back_as_it_was_given(f):
    x = inputs(f, 2).astype(jnp.float32)
    values = jax.jit(f.values)(x)
    assert (values.cop.dtype, values.travel.dtype) == (jnp.float32, jnp.float32)
    assert values.valid.dtype == bool
    assert jax.grad(lambda at: f(at).sum())(x).dtype == jnp.float32


def test_what_is_not_valid_is_masked_and_has_no_gradient(f, icub):
    x = inputs(f, 3).at[1, 2].set(9.0)
    with pytest.raises(UnreachablePostureError, match=r"row 1: .*unreachable"):
        f(x)
    masked = CopFunction(icub, copsense.minimum_torque(), NAMES, invalid="mask")

    def reward(at):
        values = masked.values(at)
        return jnp.where(values.valid, jnp.sqrt(values.travel.min(-1)), -1.0).sum()

    assert masked.values(x).valid.tolist() == [True, False, True]
    slope = np.array(jax.jit(jax.grad(reward))(x))
    assert not slope[1].any()
    assert np.abs(slope[[0, 2]]).min() > 1e-5


def test_second_derivatives_are_an_error(f):
    x = inputs(f)
    with pytest.raises(InvalidInputError, match="first derivatives by reverse mode only"):
        jax.hessian(lambda at: f(at).sum())(x)
    with pytest.raises(InvalidInputError, match="first derivatives by reverse mode only"):
        jax.grad(lambda at: jax.grad(lambda y: f.values(y).travel.sum())(at).sum())(x)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda x: x.astype(jnp.int32), "is of int32"),
        (lambda x: x[:, :3], r"shape \(2, 3\), but its last axis must hold 4 entries: com_x"),
    ],
)
def test_another_type_or_shape_is_an_error(f, change, words):
    with pytest.raises(InvalidInputError, match=words):
        f(change(inputs(f, 2)))

"""Writes a recording in the formats that robots and laboratories use, with their own libraries."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np

NUMBERS = ("fx", "fy", "fz", "mx", "my", "mz")


def of_recording(recording):
    """The arrays of a recording that every format holds."""
    return SimpleNamespace(
        t=recording["time"].values,
        joints=tuple(map(str, recording["joint"].values)),
        contacts=tuple(map(str, recording["contact"].values)),
        q=recording["joint_position"].values,
        v=recording["joint_velocity"].values,
        tau=recording["torque"].values,
        w=recording["wrench"].values,
        base=recording["configuration"].values[:, :7],
        cop=recording["cop"].values,
    )


def first(data, rows, begin=0):
    """So many rows alone."""
    kept = {
        k: v[begin : begin + rows] for k, v in vars(data).items() if k not in ("joints", "contacts")
    }
    return SimpleNamespace(joints=data.joints, contacts=data.contacts, **kept)


def table(data):
    """Headings and columns as a person would name them."""
    columns = {"time": data.t}
    columns |= {name: data.q[:, k] for k, name in enumerate(data.joints)}
    columns |= {f"{name}_vel": data.v[:, k] for k, name in enumerate(data.joints)}
    columns |= {f"{name}_torque": data.tau[:, k] for k, name in enumerate(data.joints)}
    for c, contact in enumerate(data.contacts):
        columns |= {f"{contact}_{n}": data.w[:, c, i] for i, n in enumerate(NUMBERS)}
    return columns


def write_csv(path, data):
    import pandas as pd

    pd.DataFrame(table(data)).to_csv(path, index=False)


def write_parquet(path, data):
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(pa.table({k: np.ascontiguousarray(v) for k, v in table(data).items()}), path)


def telemetry(data):
    """Structures as robometry (yarp-telemetry) saves them."""

    def channel(values, names=(), unit="radians"):
        N, k = values.shape
        found = {
            "data": values.T.reshape(k, 1, N),
            "dimensions": np.array([[k, 1, N]], float),
            "name": "channel",
            "timestamps": data.t[None] + 1.6e9,
        }
        if names:
            found["elements_names"] = np.array(names, object).reshape(-1, 1)
            found["units_of_measure"] = np.array([unit] * len(names), object).reshape(-1, 1)
        return found

    return {
        "robot_logger_device": {
            "description_list": np.array(data.joints, object).reshape(-1, 1),
            "joints_state": {
                "positions": channel(data.q, data.joints),
                "velocities": channel(data.v, data.joints),
                "torques": channel(data.tau, data.joints),
            },
            "FTs": {name: channel(data.w[:, c]) for c, name in enumerate(data.contacts)},
        }
    }


def write_matlab5(path, data):
    from scipy.io import savemat

    savemat(path, telemetry(data), long_field_names=True)


def write_matlab73(path, data):
    """The same in HDF5, as MATLAB lays it out: axes reversed, texts as numbers."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        references = file.create_group("#refs#")

        def text(group, name, value):
            item = group.create_dataset(name, data=np.array([list(map(ord, value))], "u2").T)
            item.attrs["MATLAB_class"] = np.bytes_("char")
            return item

        def put(group, name, value):
            if isinstance(value, dict):
                inner = group.create_group(name)
                inner.attrs["MATLAB_class"] = np.bytes_("struct")
                for key, each in value.items():
                    put(inner, key, each)
            elif isinstance(value, str):
                text(group, name, value)
            elif value.dtype == object:
                refs = [text(references, f"{len(references)}", str(x)).ref for x in value.ravel()]
                cell = group.create_dataset(name, (1, len(refs)), h5py.ref_dtype)
                cell[0] = refs
                cell.attrs["MATLAB_class"] = np.bytes_("cell")
            else:
                item = group.create_dataset(name, data=value.transpose())
                item.attrs["MATLAB_class"] = np.bytes_("double")

        for name, value in telemetry(data).items():
            put(file, name, value)
    with Path(path).open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


def write_simulink(path, data):
    """Structures with time, as Simulink's To Workspace makes them."""
    from scipy.io import savemat

    def signal(values, label):
        return {
            "time": data.t[:, None],
            "signals": {"values": values, "dimensions": values.shape[1], "label": label},
            "blockName": label,
        }

    found = {"joints": signal(data.q, ",".join(data.joints))}
    found |= {name: signal(data.w[:, c], name) for c, name in enumerate(data.contacts)}
    savemat(path, found)


def simulink_map(data):
    return {
        "joints": {"positions": "joints.signals.values"},
        "wrenches": [{"contact": n, "wrench": f"{n}.signals.values"} for n in data.contacts],
    }


def _messages(data, store):
    """Topic, type and the messages of a bag, stamps in nanoseconds."""
    types = store.types
    stamp = types["builtin_interfaces/msg/Time"]
    vector, point = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Point"]
    turn = types["geometry_msgs/msg/Quaternion"]
    state = types["sensor_msgs/msg/JointState"]
    wrench, stamped = types["geometry_msgs/msg/Wrench"], types["geometry_msgs/msg/WrenchStamped"]
    header_type = types["std_msgs/msg/Header"]
    seq = {"seq": 0} if "seq" in header_type.__dataclass_fields__ else {}

    for i, t in enumerate(data.t):
        ns = round(t * 1e9) + 1_600_000_000_000_000_000
        time = stamp(sec=ns // 10**9, nanosec=ns % 10**9)

        def header(frame, time=time):
            return header_type(stamp=time, frame_id=frame, **seq)

        q, v, tau = data.q[i].copy(), data.v[i].copy(), data.tau[i].copy()
        yield "/joint_states", state(header(""), list(data.joints), q, v, tau), ns
        for c, name in enumerate(data.contacts):
            f = data.w[i, c]
            six = wrench(force=vector(*f[:3]), torque=vector(*f[3:]))
            yield f"/ft/{name}", stamped(header(name), six), ns
        b = data.base[i]
        if "tf2_msgs/msg/TFMessage" in types:
            pose = types["geometry_msgs/msg/Transform"](vector(*b[:3]), turn(*b[3:]))
            moved = types["geometry_msgs/msg/TransformStamped"](header("world"), "root_link", pose)
            yield "/tf", types["tf2_msgs/msg/TFMessage"]([moved]), ns
        else:
            pose = types["geometry_msgs/msg/Pose"](point(*b[:3]), turn(*b[3:]))
            none = types["geometry_msgs/msg/Twist"](vector(0, 0, 0), vector(0, 0, 0))
            known = types["geometry_msgs/msg/PoseWithCovariance"](pose, np.zeros(36))
            twist = types["geometry_msgs/msg/TwistWithCovariance"](none, np.zeros(36))
            kind = types["nav_msgs/msg/Odometry"]
            yield "/odom", kind(header("world"), "root_link", known, twist), ns


def write_bag(path, data):
    """A ROS 1 bag for ``.bag``, and otherwise a ROS 2 bag: a folder, in MCAP or SQLite."""
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2
    from rosbags.typesys import Stores, get_typestore

    first = str(path).endswith(".bag")
    store = get_typestore(Stores.ROS1_NOETIC if first else Stores.ROS2_HUMBLE)
    if first:
        writer = Writer1(path)
    else:
        plugin = StoragePlugin.MCAP if "mcap" in str(path) else StoragePlugin.SQLITE3
        writer = Writer2(path, version=9, storage_plugin=plugin)
    with writer:
        connections = {}
        for topic, message, ns in _messages(data, store):
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            serial = store.serialize_ros1 if first else store.serialize_cdr
            writer.write(connections[topic], ns, serial(message, kind))


def write_eurobench(folder, data):
    """The folder of a trial of Eurobench's locomotion benchmark."""
    import pandas as pd
    import pinocchio as pin

    Path(folder).mkdir()
    rpy = np.array([pin.rpy.matrixToRpy(pin.Quaternion(b[3:]).matrix()) for b in data.base])
    base = {f"base_link_t{a}": data.base[:, k] for k, a in enumerate("xyz")}
    base |= {f"base_link_r{a}": rpy[:, 2 - k] for k, a in enumerate("zyx")}

    def write(name, columns):
        frame = pd.DataFrame({"time": data.t} | columns)
        frame.to_csv(Path(folder) / f"{name}.csv", sep=";", index=False)

    write("pos", base | {n: data.q[:, k] for k, n in enumerate(data.joints)})
    write("vel", {n: data.v[:, k] for k, n in enumerate(data.joints)})
    write("trq", {n: data.tau[:, k] for k, n in enumerate(data.joints)})
    names = [f"{kind}_{axis}" for kind in ("force", "torque") for axis in "xyz"]
    for name, c in (("ftl", 0), ("ftr", 1)):
        write(name, {n: data.w[:, c, i] for i, n in enumerate(names)})


# Where the plates lie in the laboratory: left and right of its origin [m].
PLATES = {"l_sole": (0.0, 0.3), "r_sole": (0.0, -0.3)}


def write_c3d(path, data):
    """Two force plates of type 2 in millimetres, their z axes down as plates have them.

    The numbers are reactions, what the plate does to the foot: Fz of one who stands is negative.
    """
    import ezc3d

    file = ezc3d.c3d()
    rate, N = 1 / (data.t[1] - data.t[0]), len(data.t)
    file["parameters"]["POINT"]["RATE"]["value"] = [rate]
    file["parameters"]["POINT"]["LABELS"]["value"] = ["marker"]
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    file["parameters"]["ANALOG"]["RATE"]["value"] = [rate]
    file["data"]["points"] = np.zeros((4, 1, N))
    flip = np.array([1.0, -1.0, -1.0])  # the plate's axes: x ahead, y right, z down
    channels, corners = [], []
    for name, (x, y) in PLATES.items():
        # The foot stands in the middle of its plate, with the laboratory's axes.
        force, moment = data.w[:, data.contacts.index(name)].reshape(N, 2, 3).swapaxes(0, 1)
        channels += [*(force * flip).T, *(moment * flip * 1e3).T]
        half = 0.25
        square = [(half, -half), (-half, -half), (-half, half), (half, half)]
        corners.append([[(x + a) * 1e3, (y + b) * 1e3, 0.0] for a, b in square])
    labels = [f"{n}{k + 1}" for k in range(2) for n in ("Fx", "Fy", "Fz", "Mx", "My", "Mz")]
    file["parameters"]["ANALOG"]["LABELS"]["value"] = labels
    file["parameters"]["ANALOG"]["UNITS"]["value"] = (["N"] * 3 + ["Nmm"] * 3) * 2
    file["data"]["analogs"] = np.array(channels)[None]
    values = {
        "USED": np.array([2]),
        "TYPE": np.array([2, 2]),
        "ZERO": np.array([1, 0]),
        "CORNERS": np.array(corners).transpose(2, 1, 0),
        "ORIGIN": np.zeros((3, 2)),
        "CHANNEL": np.arange(1, 13).reshape(2, 6).T,
    }
    for name, value in values.items():
        file.add_parameter("FORCE_PLATFORM", name, value.ravel().astype(float).tolist())
        own = file["parameters"]["FORCE_PLATFORM"][name]
        own["value"] = value
        own["type"] = 2 if value.dtype.kind == "i" else 4  # integers, or floats
    file.write(str(path))

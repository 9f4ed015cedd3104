"""Types of ROS 2 as DDS has them, for Cyclone DDS, with the names by which ROS 2 knows them there.

Written from the definitions of ROS 2, not from the sources of hivtac, which they test.
"""

from dataclasses import dataclass

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, int64, sequence, uint8, uint32, uint64


@dataclass
class Time(IdlStruct, typename="builtin_interfaces.msg.dds_.Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs.msg.dds_.Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs.msg.dds_.Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Wrench(IdlStruct, typename="geometry_msgs.msg.dds_.Wrench_"):
    force: Vector3
    torque: Vector3


@dataclass
class WrenchStamped(IdlStruct, typename="geometry_msgs.msg.dds_.WrenchStamped_"):
    header: Header
    wrench: Wrench


@dataclass
class Bool(IdlStruct, typename="std_msgs.msg.dds_.Bool_"):
    data: bool


@dataclass
class Float64(IdlStruct, typename="std_msgs.msg.dds_.Float64_"):
    data: float64


@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs.msg.dds_.KeyValue_"):
    key: str
    value: str


@dataclass
class DiagnosticStatus(
    IdlStruct, typename="diagnostic_msgs.msg.dds_.DiagnosticStatus_"
):
    level: uint8
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@dataclass
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs.msg.dds_.DiagnosticArray_"):
    header: Header
    status: sequence[DiagnosticStatus]


@dataclass
class Request(IdlStruct, typename="std_srvs.srv.dds_.Trigger_Request_"):
    """As a client on Fast DDS sends it; an empty message has a byte."""

    structure_needs_at_least_one_member: uint8


@dataclass
class Reply(IdlStruct, typename="std_srvs.srv.dds_.Trigger_Response_"):
    success: bool
    message: str


@dataclass
class CycloneRequest(IdlStruct, typename="std_srvs.srv.dds_.Trigger_Request_"):
    """As a client on Cyclone DDS sends it, which tells its requests apart by the first two."""

    client: uint64
    sequence: int64
    structure_needs_at_least_one_member: uint8


@dataclass
class CycloneReply(IdlStruct, typename="std_srvs.srv.dds_.Trigger_Response_"):
    client: uint64
    sequence: int64
    success: bool
    message: str

"""The messages of the master, from descriptors that the package brings along.

Classes are made at import, in a pool of their own. So there is no generated code that wants one certain protobuf, and
no conflict with another package that has these messages.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import resources
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

PACKAGE = "nestrad.v1"
SERVICE = "SolveService"

_FILES = descriptor_pb2.FileDescriptorSet.FromString(
    resources.files(__package__).joinpath("protocol.binpb").read_bytes()
)
_POOL = descriptor_pool.DescriptorPool()
for _file in _FILES.file:
    _POOL.AddSerializedFile(_file.SerializeToString())


def message(name: str) -> Any:
    """The class of a message, by its name in the `.proto` files."""
    return message_factory.GetMessageClass(_POOL.FindMessageTypeByName(f"{PACKAGE}.{name}"))


def number(message_name: str, field: str) -> int:
    """The number of a field on the wire."""
    descriptor = _POOL.FindMessageTypeByName(f"{PACKAGE}.{message_name}")
    return int(descriptor.fields_by_name[field].number)


def value(enum: str, name: str) -> int:
    """The number of a value of an enum."""
    descriptor = _POOL.FindEnumTypeByName(f"{PACKAGE}.{enum}")
    return int(descriptor.values_by_name[name].number)


def methods() -> Iterator[Any]:
    """The methods of the service, as MethodDescriptorProto."""
    for file in _FILES.file:
        for service in file.service:
            if service.name == SERVICE:
                yield from service.method


def response(method: Any) -> Any:
    """The class of the answer of a method."""
    return message(method.output_type.rpartition(".")[2])


SceneSlice = message("SceneSlice")
SceneHeader = message("SceneHeader")
OrganSlice = message("OrganSlice")
StartSolveRequest = message("StartSolveRequest")
SolveOptions = message("SolveOptions")
WatchSolveRequest = message("WatchSolveRequest")
FetchResultsRequest = message("FetchResultsRequest")
CancelSolveRequest = message("CancelSolveRequest")
StatusRequest = message("StatusRequest")
SoilLight = message("SoilLight")
SolveSummary = message("SolveSummary")

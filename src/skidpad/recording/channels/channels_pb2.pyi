from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional

DESCRIPTOR: _descriptor.FileDescriptor

class Channel(_message.Message):
    __slots__ = ("t", "ego", "ego_polygon", "plan", "objects", "polygon_size", "polygons", "predictions", "prediction_t", "ids", "classes")
    T_FIELD_NUMBER: _ClassVar[int]
    EGO_FIELD_NUMBER: _ClassVar[int]
    EGO_POLYGON_FIELD_NUMBER: _ClassVar[int]
    PLAN_FIELD_NUMBER: _ClassVar[int]
    OBJECTS_FIELD_NUMBER: _ClassVar[int]
    POLYGON_SIZE_FIELD_NUMBER: _ClassVar[int]
    POLYGONS_FIELD_NUMBER: _ClassVar[int]
    PREDICTIONS_FIELD_NUMBER: _ClassVar[int]
    PREDICTION_T_FIELD_NUMBER: _ClassVar[int]
    IDS_FIELD_NUMBER: _ClassVar[int]
    CLASSES_FIELD_NUMBER: _ClassVar[int]
    t: float
    ego: _containers.RepeatedScalarFieldContainer[float]
    ego_polygon: _containers.RepeatedScalarFieldContainer[float]
    plan: _containers.RepeatedScalarFieldContainer[float]
    objects: _containers.RepeatedScalarFieldContainer[float]
    polygon_size: _containers.RepeatedScalarFieldContainer[int]
    polygons: _containers.RepeatedScalarFieldContainer[float]
    predictions: _containers.RepeatedScalarFieldContainer[float]
    prediction_t: _containers.RepeatedScalarFieldContainer[float]
    ids: _containers.RepeatedScalarFieldContainer[int]
    classes: _containers.RepeatedScalarFieldContainer[int]
    def __init__(self, t: _Optional[float] = ..., ego: _Optional[_Iterable[float]] = ..., ego_polygon: _Optional[_Iterable[float]] = ..., plan: _Optional[_Iterable[float]] = ..., objects: _Optional[_Iterable[float]] = ..., polygon_size: _Optional[_Iterable[int]] = ..., polygons: _Optional[_Iterable[float]] = ..., predictions: _Optional[_Iterable[float]] = ..., prediction_t: _Optional[_Iterable[float]] = ..., ids: _Optional[_Iterable[int]] = ..., classes: _Optional[_Iterable[int]] = ...) -> None: ...

class Truth(_message.Message):
    __slots__ = ("t", "ego", "ego_polygon", "ego_mu", "actors", "polygon_size", "polygons", "ids", "classes", "mu")
    T_FIELD_NUMBER: _ClassVar[int]
    EGO_FIELD_NUMBER: _ClassVar[int]
    EGO_POLYGON_FIELD_NUMBER: _ClassVar[int]
    EGO_MU_FIELD_NUMBER: _ClassVar[int]
    ACTORS_FIELD_NUMBER: _ClassVar[int]
    POLYGON_SIZE_FIELD_NUMBER: _ClassVar[int]
    POLYGONS_FIELD_NUMBER: _ClassVar[int]
    IDS_FIELD_NUMBER: _ClassVar[int]
    CLASSES_FIELD_NUMBER: _ClassVar[int]
    MU_FIELD_NUMBER: _ClassVar[int]
    t: float
    ego: _containers.RepeatedScalarFieldContainer[float]
    ego_polygon: _containers.RepeatedScalarFieldContainer[float]
    ego_mu: float
    actors: _containers.RepeatedScalarFieldContainer[float]
    polygon_size: _containers.RepeatedScalarFieldContainer[int]
    polygons: _containers.RepeatedScalarFieldContainer[float]
    ids: _containers.RepeatedScalarFieldContainer[int]
    classes: _containers.RepeatedScalarFieldContainer[int]
    mu: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, t: _Optional[float] = ..., ego: _Optional[_Iterable[float]] = ..., ego_polygon: _Optional[_Iterable[float]] = ..., ego_mu: _Optional[float] = ..., actors: _Optional[_Iterable[float]] = ..., polygon_size: _Optional[_Iterable[int]] = ..., polygons: _Optional[_Iterable[float]] = ..., ids: _Optional[_Iterable[int]] = ..., classes: _Optional[_Iterable[int]] = ..., mu: _Optional[_Iterable[float]] = ...) -> None: ...

class Decision(_message.Message):
    __slots__ = ("t", "driving", "reason", "scores")
    T_FIELD_NUMBER: _ClassVar[int]
    DRIVING_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    SCORES_FIELD_NUMBER: _ClassVar[int]
    t: float
    driving: str
    reason: str
    scores: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, t: _Optional[float] = ..., driving: _Optional[str] = ..., reason: _Optional[str] = ..., scores: _Optional[_Iterable[float]] = ...) -> None: ...

class Context(_message.Message):
    __slots__ = ("t", "entries")
    class EntriesEntry(_message.Message):
        __slots__ = ("key", "value")
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: str
        def __init__(self, key: _Optional[str] = ..., value: _Optional[str] = ...) -> None: ...
    T_FIELD_NUMBER: _ClassVar[int]
    ENTRIES_FIELD_NUMBER: _ClassVar[int]
    t: float
    entries: _containers.ScalarMap[str, str]
    def __init__(self, t: _Optional[float] = ..., entries: _Optional[_Mapping[str, str]] = ...) -> None: ...

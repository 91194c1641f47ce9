"""sensor_msgs/msg/BatteryState."""

from typing import ClassVar

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import Float32Array, Float32Sequence, float32, uint8


class BatteryState(Message, type_name="sensor_msgs/msg/BatteryState"):
    """sensor_msgs/msg/BatteryState."""

    POWER_SUPPLY_STATUS_UNKNOWN: ClassVar[uint8] = 0
    POWER_SUPPLY_STATUS_CHARGING: ClassVar[uint8] = 1
    POWER_SUPPLY_STATUS_DISCHARGING: ClassVar[uint8] = 2
    POWER_SUPPLY_STATUS_NOT_CHARGING: ClassVar[uint8] = 3
    POWER_SUPPLY_STATUS_FULL: ClassVar[uint8] = 4
    POWER_SUPPLY_HEALTH_UNKNOWN: ClassVar[uint8] = 0
    POWER_SUPPLY_HEALTH_GOOD: ClassVar[uint8] = 1
    POWER_SUPPLY_HEALTH_OVERHEAT: ClassVar[uint8] = 2
    POWER_SUPPLY_HEALTH_DEAD: ClassVar[uint8] = 3
    POWER_SUPPLY_HEALTH_OVERVOLTAGE: ClassVar[uint8] = 4
    POWER_SUPPLY_HEALTH_UNSPEC_FAILURE: ClassVar[uint8] = 5
    POWER_SUPPLY_HEALTH_COLD: ClassVar[uint8] = 6
    POWER_SUPPLY_HEALTH_WATCHDOG_TIMER_EXPIRE: ClassVar[uint8] = 7
    POWER_SUPPLY_HEALTH_SAFETY_TIMER_EXPIRE: ClassVar[uint8] = 8
    POWER_SUPPLY_TECHNOLOGY_UNKNOWN: ClassVar[uint8] = 0
    POWER_SUPPLY_TECHNOLOGY_NIMH: ClassVar[uint8] = 1
    POWER_SUPPLY_TECHNOLOGY_LION: ClassVar[uint8] = 2
    POWER_SUPPLY_TECHNOLOGY_LIPO: ClassVar[uint8] = 3
    POWER_SUPPLY_TECHNOLOGY_LIFE: ClassVar[uint8] = 4
    POWER_SUPPLY_TECHNOLOGY_NICD: ClassVar[uint8] = 5
    POWER_SUPPLY_TECHNOLOGY_LIMN: ClassVar[uint8] = 6
    POWER_SUPPLY_TECHNOLOGY_TERNARY: ClassVar[uint8] = 7
    POWER_SUPPLY_TECHNOLOGY_VRLA: ClassVar[uint8] = 8

    header: Header = msgspec.field(default_factory=Header)
    voltage: float32 = 0.0
    temperature: float32 = 0.0
    current: float32 = 0.0
    charge: float32 = 0.0
    capacity: float32 = 0.0
    design_capacity: float32 = 0.0
    percentage: float32 = 0.0
    power_supply_status: uint8 = 0
    power_supply_health: uint8 = 0
    power_supply_technology: uint8 = 0
    present: bool = False
    cell_voltage: Float32Sequence = msgspec.field(default_factory=Float32Array)
    cell_temperature: Float32Sequence = msgspec.field(default_factory=Float32Array)
    location: str = ""
    serial_number: str = ""

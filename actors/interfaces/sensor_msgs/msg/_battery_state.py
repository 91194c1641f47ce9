"""sensor_msgs/msg/BatteryState."""

from typing import ClassVar

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import Float32Array, Float32Sequence, float32, uint8


class BatteryState(Message, type_name="sensor_msgs/msg/BatteryState"):
    """Charge, health and kind of a battery."""

    POWER_SUPPLY_STATUS_UNKNOWN: ClassVar[uint8] = 0
    """It is not known whether the battery charges."""
    POWER_SUPPLY_STATUS_CHARGING: ClassVar[uint8] = 1
    """It is being charged."""
    POWER_SUPPLY_STATUS_DISCHARGING: ClassVar[uint8] = 2
    """It powers the robot."""
    POWER_SUPPLY_STATUS_NOT_CHARGING: ClassVar[uint8] = 3
    """A charger is connected, but does not charge it."""
    POWER_SUPPLY_STATUS_FULL: ClassVar[uint8] = 4
    """It is fully charged."""
    POWER_SUPPLY_HEALTH_UNKNOWN: ClassVar[uint8] = 0
    """The health is not known."""
    POWER_SUPPLY_HEALTH_GOOD: ClassVar[uint8] = 1
    """No fault was detected."""
    POWER_SUPPLY_HEALTH_OVERHEAT: ClassVar[uint8] = 2
    """It is too hot."""
    POWER_SUPPLY_HEALTH_DEAD: ClassVar[uint8] = 3
    """It holds no charge any more."""
    POWER_SUPPLY_HEALTH_OVERVOLTAGE: ClassVar[uint8] = 4
    """Its voltage is too high."""
    POWER_SUPPLY_HEALTH_UNSPEC_FAILURE: ClassVar[uint8] = 5
    """It has a fault of another kind."""
    POWER_SUPPLY_HEALTH_COLD: ClassVar[uint8] = 6
    """It is too cold."""
    POWER_SUPPLY_HEALTH_WATCHDOG_TIMER_EXPIRE: ClassVar[uint8] = 7
    """The charger stopped, as its watchdog was not reset."""
    POWER_SUPPLY_HEALTH_SAFETY_TIMER_EXPIRE: ClassVar[uint8] = 8
    """The charger stopped, as charging took longer than allowed."""
    POWER_SUPPLY_TECHNOLOGY_UNKNOWN: ClassVar[uint8] = 0
    """The chemistry is not known."""
    POWER_SUPPLY_TECHNOLOGY_NIMH: ClassVar[uint8] = 1
    """Nickel-metal hydride."""
    POWER_SUPPLY_TECHNOLOGY_LION: ClassVar[uint8] = 2
    """Lithium-ion."""
    POWER_SUPPLY_TECHNOLOGY_LIPO: ClassVar[uint8] = 3
    """Lithium-ion polymer."""
    POWER_SUPPLY_TECHNOLOGY_LIFE: ClassVar[uint8] = 4
    """Lithium iron phosphate (LiFePO4)."""
    POWER_SUPPLY_TECHNOLOGY_NICD: ClassVar[uint8] = 5
    """Nickel-cadmium."""
    POWER_SUPPLY_TECHNOLOGY_LIMN: ClassVar[uint8] = 6
    """Lithium manganese oxide."""
    POWER_SUPPLY_TECHNOLOGY_TERNARY: ClassVar[uint8] = 7
    """Lithium nickel manganese cobalt oxide."""
    POWER_SUPPLY_TECHNOLOGY_VRLA: ClassVar[uint8] = 8
    """Valve-regulated (sealed) lead-acid."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the measurement; the frame is rarely set."""
    voltage: float32 = 0.0
    """Voltage between the terminals, in volts; always given."""
    temperature: float32 = 0.0
    """Temperature of the battery, in degrees Celsius; NaN if it is not measured."""
    current: float32 = 0.0
    """Current, in amperes; negative while it discharges; NaN if it is not measured."""
    charge: float32 = 0.0
    """Charge that is left, in ampere hours; NaN if it is not known."""
    capacity: float32 = 0.0
    """Charge of the full battery at its present age, in ampere hours; NaN if it is not known."""
    design_capacity: float32 = 0.0
    """Charge of the full battery when it was new, in ampere hours; NaN if it is not known."""
    percentage: float32 = 0.0
    """Charge that is left as a fraction from 0 to 1 (not to 100); NaN if it is not known."""
    power_supply_status: uint8 = 0
    """Whether it charges: one of POWER_SUPPLY_STATUS_*."""
    power_supply_health: uint8 = 0
    """Its health: one of POWER_SUPPLY_HEALTH_*."""
    power_supply_technology: uint8 = 0
    """Its chemistry: one of POWER_SUPPLY_TECHNOLOGY_*."""
    present: bool = False
    """True if a battery is inserted."""
    cell_voltage: Float32Sequence = msgspec.field(default_factory=Float32Array)
    """Voltage of each cell, in volts; NaN for each if only the number of cells is known."""
    cell_temperature: Float32Sequence = msgspec.field(default_factory=Float32Array)
    """Temperature of each cell, in degrees Celsius; NaN for each if not measured."""
    location: str = ""
    """Where the battery is mounted, such as the name of a slot."""
    serial_number: str = ""
    """Serial number, or what else identifies the battery."""

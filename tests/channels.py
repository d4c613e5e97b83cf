"""The channels of the simulated acquisition device."""

from daq.channels import Bridge, Channel, ChannelKind

HAMMER = Channel("hammer", "cDAQ1Mod1/ai0", ChannelKind.FORCE_IEPE, 2.25e-3, "N", -2000, 2000, 2e-3)
ACCELEROMETER = Channel(
    "accelerometer", "cDAQ1Mod1/ai1", ChannelKind.ACCELERATION_IEPE, 10.2e-3, "m/s^2", -450, 450, 2e-3
)
DISPLACEMENT = Channel("displacement", "cDAQ1Mod2/ai0", ChannelKind.VOLTAGE, 2e3, "m", -5e-3, 5e-3)
FORCE = Channel("force", "cDAQ1Mod2/ai1", ChannelKind.VOLTAGE, 2e-3, "N", -5000, 5000)
HAMMER_CHANNELS, TESTER_CHANNELS = (HAMMER, ACCELEROMETER), (DISPLACEMENT, FORCE)
LOAD_CELL = Channel(
    "force", "cDAQ1Mod3/ai0", ChannelKind.FORCE_BRIDGE, 0.4e-6, "N", -5000, 5000, serial="SN 4711", bridge=Bridge(5.0)
)
CHARGE_HAMMER = Channel("hammer", "PXI1Slot2/ai0", ChannelKind.FORCE_CHARGE, 4e-12, "N", -2000, 2000)
CHARGE_ACCELEROMETER = Channel(
    "accelerometer", "PXI1Slot2/ai1", ChannelKind.ACCELERATION_CHARGE, 10e-12, "m/s^2", -450, 450
)

"""The channels of the simulated acquisition device."""

from daq.channels import Channel, ChannelKind

HAMMER = Channel("hammer", "cDAQ1Mod1/ai0", ChannelKind.FORCE_IEPE, 2.25e-3, "N", -2000, 2000, 2e-3)
ACCELEROMETER = Channel(
    "accelerometer", "cDAQ1Mod1/ai1", ChannelKind.ACCELERATION_IEPE, 10.2e-3, "m/s^2", -450, 450, 2e-3
)
DISPLACEMENT = Channel("displacement", "cDAQ1Mod2/ai0", ChannelKind.VOLTAGE, 2e3, "m", -5e-3, 5e-3)
FORCE = Channel("force", "cDAQ1Mod2/ai1", ChannelKind.VOLTAGE, 2e-3, "N", -5000, 5000)
HAMMER_CHANNELS, TESTER_CHANNELS = (HAMMER, ACCELEROMETER), (DISPLACEMENT, FORCE)

"""The drive process of one rig: the only one that moves it. It knows no database, no page and no simulation."""

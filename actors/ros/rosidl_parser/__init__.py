"""The types that message classes have in `SLOT_TYPES`; parsing is `actors.interfaces`'s."""

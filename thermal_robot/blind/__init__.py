"""The blind trial: robots whose fault is hidden are diagnosed, and the answers scored."""

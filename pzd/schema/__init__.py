"""Reading and checking what people and programs write: models, YAML, CSV, errors."""

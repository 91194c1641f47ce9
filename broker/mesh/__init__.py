"""The mesh: brokers whose nodes see each other as if one broker had them all."""

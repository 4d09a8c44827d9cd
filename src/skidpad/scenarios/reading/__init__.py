"""From files to elements: XML, parameters, expressions, catalogs, entities; findings by line."""
